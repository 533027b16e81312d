"""The side of a hand, from tracks of both sides."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from depthtrack.calibration import sides
from depthtrack.calibration.first_scale import FirstHand
from depthtrack.calibration.options import CalibrationOptions
from depthtrack.calibration.sides import calibrate_either_side
from depthtrack.cli import main
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.size_parameters import COUNT, SCALE, prior_covariance, size_deviation
from depthtrack.recording import SequenceWriter, open_sequence
from depthtrack.recording.run_folder import Run
from depthtrack.synthesis.generate import Synthesis, Synthesiser, write_recording
from depthtrack.tracking import stretches
from depthtrack.tracking.run_configuration import RunConfiguration
from depthtrack.tracking.side_choice import SideChoice, SideOptions, choose_side, mean_energies
from depthtrack.tracking.stretches import StretchOptions, track_hands, track_stretches
from depthtrack.tracking.tracker import ABSENT, Estimate

OPTIONS = SideOptions(StretchOptions(stretches=2, stretch_frames=3))


def recorded(folder: Path, side: Side) -> Path:
    """Write a recording of a hand whose side is not stated."""
    made = Synthesiser(Synthesis(motion="everyday", model="skin", hand=HandShape(side=side), frames=40))
    write_recording(made, folder)
    (folder / "hand.json").unlink()
    return folder


def test_frames_are_spread_over_the_recording() -> None:
    assert StretchOptions(stretches=3, stretch_frames=2).frames(11) == [0, 1, 4, 5, 9, 10]
    assert StretchOptions(stretches=3, stretch_frames=20).frames(5) == [0, 1, 2, 3, 4]
    assert StretchOptions(stretches=3, stretch_frames=2).ranges(11) == [range(2), range(4, 6), range(9, 11)]
    assert StretchOptions(stretches=3, stretch_frames=4).ranges(10) == [range(3), range(3, 7), range(7, 10)]
    assert StretchOptions(stretches=8, stretch_frames=4).ranges(2) == [range(1), range(1, 2)]


@pytest.mark.slow
def test_hands_side_by_side_are_tracked_as_each_alone(tmp_path: Path) -> None:
    sequence, hands = open_sequence(recorded(tmp_path / "recording", "left")), [HandShape(), HandShape(side="left")]
    both = track_hands(sequence, hands, threads=2, options=OPTIONS.stretches)
    for hand, found in zip(hands, both, strict=True):
        alone = track_stretches(sequence, hand, options=OPTIONS.stretches)
        np.testing.assert_array_equal(found.energies, alone.energies)
        assert [view.pose.tolist() for view in found.views] == [view.pose.tolist() for view in alone.views]
        assert len(alone.views) > 0


@pytest.mark.slow
def test_stretches_begin_with_estimates_of_their_first_frames(tmp_path: Path) -> None:
    """The second track is as good, and the same for any number of threads."""
    sequence, hand = open_sequence(recorded(tmp_path / "recording", "right")), HandShape()
    options, reported = OPTIONS.stretches, list[tuple[int, int]]()
    searched = track_stretches(sequence, hand, options=options)
    assert list(searched.starts) == [0, 37]
    found = [
        track_stretches(sequence, hand, None, threads, None, options, lambda *pair: reported.append(pair), starts)
        for threads, starts in ((1, searched.starts), (3, searched.starts), (2, {37: searched.starts[37]}))
    ]
    np.testing.assert_array_equal(found[0].energies, found[1].energies)
    np.testing.assert_array_equal(found[0].energies[3:], found[2].energies[3:])
    np.testing.assert_array_equal(searched.energies[:3], found[2].energies[:3])
    assert np.median(found[0].energies) <= 1.02 * np.median(searched.energies)
    assert reported == 3 * [(3, 6), (6, 6)]


@dataclass
class Stepped:
    """What a pipeline states about a frame."""

    estimate: Estimate
    observation: None = None


class Stuck:
    """Pipeline that keeps the energy that it begins with."""

    def __init__(self, energy: float) -> None:
        self._estimate = replace(ABSENT, energy=energy)

    def restore(self, estimates: Sequence[Estimate]) -> None:
        self._estimate = estimates[-1]

    def step(self, frame: object) -> Stepped:
        return Stepped(self._estimate)


@pytest.mark.parametrize(("anew", "energies"), [(True, [3, 3, 1, 1, 1, 1]), (False, [3] * 6)])
def test_a_track_that_began_wrong_begins_anew_in_the_next_stretch(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, anew: bool, energies: list[float]
) -> None:
    begun = iter([3.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
    monkeypatch.setattr(stretches, "Pipeline", lambda *rest: Stuck(next(begun)))
    write_recording(Synthesiser(Synthesis(frames=6)), tmp_path / "recording")
    options = StretchOptions(stretches=3, stretch_frames=2, anew=anew)
    found = track_stretches(open_sequence(tmp_path / "recording"), HandShape(), options=options)
    assert found.energies.tolist() == energies


def test_frames_that_began_wrong_make_no_side_certain() -> None:
    right, left = np.full(40, 14.0), np.full(40, 14.5)
    left[:10] = 48.0
    means, count = mean_energies({"right": right, "left": left})
    assert count == 40
    assert means["right"] == 14.0
    assert means["left"] / means["right"] - 1 < SideOptions().sure_margin
    worse, _ = mean_energies({"right": right, "left": left + 5})
    assert worse["left"] > means["left"]


@pytest.mark.slow
@pytest.mark.parametrize("side", ["right", "left"])
def test_the_side_is_found_and_its_hand_tracked(tmp_path: Path, side: Side, capsys: pytest.CaptureFixture[str]) -> None:
    path = recorded(tmp_path / "recording", side)
    choice = choose_side(open_sequence(path), options=OPTIONS)
    assert (choice.side, choice.frames) == (side, 6)
    assert choice.margin > 0.05
    assert choice.sure == (choice.margin >= OPTIONS.sure_margin)
    command = ["track", str(path), "-o", str(tmp_path / "run"), "--frames", "4", "--tracker", "ik", "--hand", "average"]
    assert main(command) == 0
    assert f"a {side} hand: a " in capsys.readouterr().out
    run = Run.load(tmp_path / "run")
    assert RunConfiguration.of(run).hand_shape().side == side
    assert main([*command, "--resume"]) == 0


@pytest.mark.slow
def test_a_hand_given_of_the_wrong_side_is_reported_after_the_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = recorded(tmp_path / "recording", "left")
    command = ["track", str(path), "--tracker", "ik", "--hand", "average"]
    assert main([*command, "-o", str(tmp_path / "wrong"), "--side", "right"]) == 0
    assert "give --side left, or --mirror" in capsys.readouterr().out
    assert main([*command, "-o", str(tmp_path / "right"), "--side", "left"]) == 0
    assert "--mirror" not in capsys.readouterr().out
    # The images mirrored back show a right hand.
    assert main([*command, "-o", str(tmp_path / "mirrored"), "--side", "right", "--mirror"]) == 0
    assert "--mirror" not in capsys.readouterr().out


def test_a_recording_without_a_hand_leaves_the_side_open(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = Synthesiser(Synthesis(frames=1))
    with SequenceWriter(tmp_path / "empty", made.sensor.camera) as writer:
        for index in range(3):
            writer.append(index / 30, np.zeros(made.sensor.camera.shape, np.float32))
    assert choose_side(open_sequence(tmp_path / "empty"), options=OPTIONS) == SideChoice("right", 0.0, False, 0)
    assert main(["track", str(tmp_path / "empty"), "-o", str(tmp_path / "run"), "--tracker", "ik"]) == 0
    assert "the average adult's right hand is assumed" in capsys.readouterr().out
    assert Run.load(tmp_path / "run").status == ("absent",) * 3


@pytest.mark.parametrize(("sure", "compared"), [(True, True), (False, True), (False, False)])
def test_both_sides_are_calibrated_only_if_the_side_is_open(
    monkeypatch: pytest.MonkeyPatch, sure: bool, compared: bool
) -> None:
    @dataclass(frozen=True)
    class Measured:
        hand: HandShape
        after_mm: float
        energies: np.ndarray
        side_margin: float | None = None
        sure_margin: float = CalibrationOptions().sure_margin
        side_agrees: bool = True

    tried, skins = list[Side](), list[Side]()

    @dataclass(frozen=True)
    class Sized:
        side: Side
        values: np.ndarray
        energies: np.ndarray

    # Energies are compared only if a frame shows both hands.
    energies = {"right": np.array([11.0, np.nan]), "left": np.array([10.0, 1.0] if compared else [np.nan, 1.0])}
    distances = {"right": 1.0, "left": 2.0}

    def fit_sizes(source: object, side: Side, first: FirstHand, *rest: object) -> Sized:
        assert first.scale == {"right": 1.1, "left": 0.9}[side]
        tried.append(side)
        return Sized(side, np.zeros(COUNT), energies[side])

    def fit_skin(source: object, sized: Sized, *rest: object) -> Sized:
        skins.append(sized.side)
        return sized

    def calibration_of(source: object, sized: Sized) -> Measured:
        return Measured(HandShape(side=sized.side), distances[sized.side], sized.energies)

    def choose_side(*rest: object) -> SideChoice:
        # Hands of both sides have their own scales.
        assert rest[-1] == {"right": 1.1, "left": 0.9}
        return SideChoice("left", 0.27, sure, 10, {}, {"right": {}, "left": {}})

    monkeypatch.setattr(sides, "choose_side", choose_side)
    monkeypatch.setattr(sides, "first_hand", lambda source, side: FirstHand({"right": 1.1, "left": 0.9}[side], {}))
    monkeypatch.setattr(sides, "fit_sizes", fit_sizes)
    monkeypatch.setattr(sides, "fit_skin", fit_skin)
    monkeypatch.setattr(sides, "calibration_of", calibration_of)
    monkeypatch.setattr(
        sides, "calibrate", lambda s, side, *rest: calibration_of(s, fit_skin(s, fit_sizes(s, side, rest[-1])))
    )
    found = calibrate_either_side(None)  # type: ignore[arg-type]
    assert tried == (["left"] if sure else ["right", "left"])
    # The skin of the side that was chosen is fitted alone.
    assert skins == ["left" if sure else "right"]
    assert found.hand.side == ("left" if sure else "right")
    assert found.side_margin == pytest.approx(0.27 if sure else 2 * (10 / 11 if compared else 1) / 1.27 - 1)
    assert found.side_agrees == sure
    assert found.sure_margin == (SideOptions().sure_margin if sure else CalibrationOptions().sure_margin)


def test_uncommon_sizes_raise_the_cost_of_a_side() -> None:
    options = CalibrationOptions()
    factors = sides.size_costs({"right": 40.0, "left": 120.0}, options)
    assert factors["left"] / factors["right"] == pytest.approx(((COUNT + 120) / (COUNT + 40)) ** options.size_weight)
    # Among uncommon hands the same difference counts less.
    others = sides.size_costs({"right": 240.0, "left": 320.0}, options)
    assert 1 < others["left"] / others["right"] < factors["left"] / factors["right"]
    assert sides.size_costs({"right": 240.0, "left": 320.0}, replace(options, size_weight=0.0)) == {
        "right": 1.0,
        "left": 1.0,
    }
    # One standard deviation of the scale of people, and none of another size.
    values = np.zeros(COUNT)
    values[SCALE] = np.sqrt(prior_covariance()[SCALE, SCALE])
    assert size_deviation(values, prior_covariance()) == pytest.approx(1.0)

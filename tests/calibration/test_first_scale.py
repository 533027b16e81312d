"""The size of a whole hand from single frames."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.calibration import first_scale
from depthtrack.calibration.first_scale import FirstHand, around_lowest, first_hand, lowest_of_parabola
from depthtrack.calibration.options import CalibrationOptions
from depthtrack.calibration.recorded_views import CalibrationSource
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import POSITION
from depthtrack.hand.shape import HandShape, Side
from depthtrack.recording import open_sequence
from depthtrack.recording.status import Status
from depthtrack.segmentation.observation import Observation
from depthtrack.synthesis.generate import Synthesis, Synthesiser, write_recording
from depthtrack.tracking.guided_segmentation import segment_start
from depthtrack.tracking.tracker import Estimate


@given(
    place=st.floats(-0.9, 0.9),
    curvature=st.floats(0.1, 100),
    samples=st.lists(st.floats(-1, 1), min_size=3, max_size=8, unique_by=lambda x: round(x, 2)),
)
def test_the_lowest_place_of_a_parabola(place: float, curvature: float, samples: list[float]) -> None:
    x = np.sort(samples)
    y = curvature * (x - place) ** 2
    lowest = int(np.argmin(y))
    found = lowest_of_parabola(x, y)
    if 0 < lowest < len(x) - 1:
        assert found == pytest.approx(place, abs=1e-6)
    else:
        assert found == x[lowest]


@given(energies=st.lists(st.floats(0, 1), min_size=2, max_size=8, unique=True), data=st.data())
def test_a_minimum_is_compared_with_its_neighbours(energies: list[float], data: st.DataObject) -> None:
    count, place = len(energies), data.draw(st.integers(0, len(energies) - 1))
    valley = sorted(energies[:place], reverse=True) + sorted(energies[place:])  # falls, then rises
    first = data.draw(st.integers(0, count - 1))
    for y in (energies, valley):
        found = around_lowest(count, first, y.__getitem__)
        lowest = min(found, key=y.__getitem__)
        assert {lowest - 1, lowest, lowest + 1} & set(range(count)) <= set(found)
        assert found == {number: y[number] for number in found}
    assert valley[lowest] == min(valley)


@pytest.mark.slow
@pytest.mark.parametrize(("scale", "side", "assumed"), [(0.78, "left", "right"), (1.15, "right", "right")])
def test_the_scale_of_a_recorded_hand(tmp_path: Path, scale: float, side: Side, assumed: Side) -> None:
    hand = HandShape(side=side, scale=scale)
    options = Synthesis("everyday", hand=hand, model="skin", background="room", frames=60, rate=15.0)
    write_recording(Synthesiser(options), tmp_path / "recording")
    source = CalibrationSource(open_sequence(tmp_path / "recording"), None, 0, 1, None, CalibrationOptions())
    found = first_hand(source, assumed)
    assert found.scale == pytest.approx(scale, rel=0.06)
    assert set(found.starts) <= set(source.first_frames)
    assert len(found.starts) >= 0.7 * len(source.first_frames)
    model, truth = HandModel(HandShape(side=assumed, scale=found.scale)), source.sequence.ground_truth
    assert truth is not None
    for index, starts in found.starts.items():
        joints = truth.keypoints_at(float(source.sequence.timestamps[index]))
        assert joints is not None
        poses = np.array([each.pose for each in starts], np.float64)
        assert np.all(np.linalg.norm(model.keypoints(poses) - joints, axis=2).mean(axis=1) < 0.02)
    two = first_hand(replace(source, threads=2), assumed)
    assert two.scale == found.scale
    one, other = ([each.pose for starts in hand.starts.values() for each in starts] for hand in (found, two))
    np.testing.assert_array_equal(np.array(one), np.array(other))


def test_a_start_at_another_place_is_observed_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Hands of other scales are fitted to what surrounds it."""
    options = Synthesis("everyday", background="room", frames=1)
    write_recording(Synthesiser(options), tmp_path / "recording")
    source = CalibrationSource(open_sequence(tmp_path / "recording"), None, 0, 1, None, CalibrationOptions())
    truth = source.sequence.ground_truth
    assert truth is not None
    assert truth.poses is not None
    pose, elsewhere = truth.poses[0], np.array([0.2, 0.0, 0.0])

    class Chooser:
        def start(self, observation: Observation) -> Estimate:
            return Estimate(pose, 1.0, 1.0, Status.STARTED)

        def close(self) -> None:
            pass

    def observed(*arguments: Any) -> Observation:
        found = segment_start(*arguments)
        assert found is not None
        return replace(found, centre=found.centre + elsewhere)

    monkeypatch.setattr(first_scale, "create_tracker", lambda *_: Chooser())
    monkeypatch.setattr(first_scale, "segment_start", observed)
    found = first_scale._start(source, HandShape(), source.sequence[0])
    assert found is not None
    np.testing.assert_array_equal(found.pose, pose)
    np.testing.assert_allclose(found.observation.centre, pose[POSITION], atol=0.03)


def test_without_scales_to_compare_the_hand_is_the_average_one() -> None:
    options = replace(CalibrationOptions(), first_scales=())
    source = CalibrationSource(None, None, 0, 1, None, options)  # type: ignore[arg-type]
    assert first_hand(source) == FirstHand(1.0, {})

"""Times of folders of other tools: units, doubled and backward times, times without use."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.recording import open_sequence
from depthtrack.recording.reading import ReadingOptions, TimeUnit
from depthtrack.recording.time_units import ASSUMED_RATE, SECONDS_PER_UNIT, clock_of
from tests.support.folders import each_line, lines_of, stripped_sample, write_lines
from tests.support.recordings import TIMES, write_sample

EPOCH = 1_600_000_000


@pytest.fixture
def sample(tmp_path: Path) -> Path:
    return stripped_sample(tmp_path / "sample")


WRITTEN: dict[str, tuple[Callable[[float, str], str], float, str]] = {
    "milliseconds": (lambda t, name: f"{1000 * t:.0f} {name}", 0, "milliseconds"),
    "milliseconds with decimals": (lambda t, name: f"{1000 * t:.3f} {name}", 0, "milliseconds"),
    "microseconds": (lambda t, name: f"{1e6 * t:.0f} {name}", 0, "microseconds"),
    "nanoseconds": (lambda t, name: f"{1e9 * t:.0f} {name}", 0, "nanoseconds"),
    "nanoseconds with exponents": (lambda t, name: f"{1e9 * t:.6e} {name}", 0, "nanoseconds"),
    "epoch in milliseconds": (lambda t, name: f"{1000 * (EPOCH + t):.0f} {name}", EPOCH, "milliseconds"),
    "epoch in microseconds": (lambda t, name: f"{EPOCH * 10**6 + round(1e6 * t)} {name}", EPOCH, "microseconds"),
    "epoch in nanoseconds": (lambda t, name: f"{EPOCH * 10**9 + round(1e9 * t)} {name}", EPOCH, "nanoseconds"),
}


@pytest.mark.parametrize("written", WRITTEN)
def test_the_unit_of_times_is_found_from_their_steps_and_named(sample: Path, written: str) -> None:
    write, offset, name = WRITTEN[written]
    each_line(write)(sample)
    sequence = open_sequence(sample)
    np.testing.assert_allclose(sequence.timestamps - offset, TIMES, atol=1e-6)
    (note,) = sequence.notes
    assert f"read as {name}" in note
    assert "--time-unit" in note
    assert all(frame.colour is not None for frame in sequence)


def test_seconds_need_no_note(sample: Path) -> None:
    assert open_sequence(sample).notes == []
    each_line(lambda t, name: f"{EPOCH + t:.6f} {name}")(sample)
    assert open_sequence(sample).notes == []


def test_numbers_of_frames_are_at_30_hz(sample: Path) -> None:
    for name in ("depth.txt", "rgb.txt"):
        write_lines(sample / name, [f"{k} {image}" for k, (_, image) in enumerate(lines_of(sample / name), start=7)])
    sequence = open_sequence(sample)
    np.testing.assert_allclose(sequence.timestamps, np.arange(7, 12) / ASSUMED_RATE)
    assert "numbers of frames at 30 Hz" in sequence.notes[0]
    np.testing.assert_allclose(
        open_sequence(sample, reading=ReadingOptions(time_unit="s")).timestamps, np.arange(7, 12)
    )


def test_times_of_an_unusual_rate_are_reported(sample: Path) -> None:
    each_line(lambda t, name: f"{100 * t} {name}", ("depth.txt",))(sample)
    assert any("3.35 s apart" in note and "--time-unit" in note for note in open_sequence(sample).notes)


def test_annotations_have_the_unit_of_the_lists(tmp_path: Path) -> None:
    folder = write_sample(tmp_path / "sample")
    before = open_sequence(folder).ground_truth
    assert before is not None
    each_line(lambda t, name: f"{1000 * t:.0f} {name}")(folder)
    for name in ("hand_poses.csv", "joints.csv"):
        header, *rows = (folder / name).read_text().splitlines()
        cells = [row.split(",", 1) for row in rows]
        write_lines(folder / name, [header, *(f"{1000 * float(time):.0f},{rest}" for time, rest in cells)])
    after = open_sequence(folder).ground_truth
    assert after is not None
    np.testing.assert_allclose(after.timestamps, before.timestamps)


@given(
    st.sampled_from(["s", "ms", "us", "ns"]),
    st.floats(0.016, 0.2),
    st.sampled_from([0.0, 3.7, 1.6e9]),
    st.lists(st.floats(0.7, 1.3), min_size=4, max_size=30),
)
def test_the_unit_of_any_camera_is_found(unit: TimeUnit, period: float, start: float, jitter: list[float]) -> None:
    times = (start + np.cumsum(period * np.array(jitter))) / SECONDS_PER_UNIT[unit]
    assert clock_of(times, whole=False).unit == unit


@pytest.mark.parametrize(
    ("row", "time", "left_out", "kept"),
    [(1, 0.0, 1, 4), (3, 0.05, 1, 4), (1, 99.0, 1, 4), (4, 0.0, 1, 4)],
    ids=["doubled", "backward", "one far ahead", "clock set back at the end"],
)
def test_times_that_do_not_increase_are_refused_or_left_out_and_counted(
    sample: Path, capsys: pytest.CaptureFixture[str], row: int, time: float, left_out: int, kept: int
) -> None:
    rows = lines_of(sample / "depth.txt")
    rows[row] = (time, rows[row][1])
    write_lines(sample / "depth.txt", [f"{t} {name}" for t, name in rows])
    with pytest.raises(InputError, match=r"line \d: timestamps must increase.*--on-damage skip.*--time-unit index"):
        open_sequence(sample)
    sequence = open_sequence(sample, on_damage="skip")
    assert len(list(sequence)) == kept
    assert np.all(np.diff(sequence.timestamps) > 0)
    note = f"{left_out} of 5 lines of depth.txt are left out"
    assert any(note in each for each in sequence.notes)
    assert main(["info", str(sample), "--on-damage", "skip"]) == 0
    assert note in capsys.readouterr().out


def test_exponents_that_rounded_all_times_to_one_have_a_remedy(sample: Path) -> None:
    each_line(lambda t, name: f"{EPOCH + t:.4e} {name}")(sample)
    with pytest.raises(InputError, match=r"write more digits.*--time-unit index"):
        open_sequence(sample)
    sequence = open_sequence(sample, reading=ReadingOptions(time_unit="index"))
    np.testing.assert_allclose(sequence.timestamps, np.arange(5) / ASSUMED_RATE)
    assert [frame.colour is not None for frame in sequence] == [True] * 5


def test_times_beyond_those_of_runs_are_refused(sample: Path) -> None:
    each_line(lambda t, name: f"{1e13 + t} {name}")(sample)
    with pytest.raises(InputError, match="--time-unit"):
        open_sequence(sample, on_damage="skip", reading=ReadingOptions(time_unit="s"))

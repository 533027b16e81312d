"""Harder versions of recorded captures."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.formats.registry import read_capture, write_capture
from depthtrack.synthesis.recorded_capture import cut_stretches, strip_labels


def recorded(frames: int = 400, seed: int = 0) -> MarkerCapture:
    rng = np.random.default_rng(seed)
    positions = rng.normal([0, 0, 1], 0.1, (frames, 5, 3))
    positions[50:90, 1] = np.nan
    return MarkerCapture(100.0, ("a", "b", "c", "*1", "d"), positions)


def test_stripped_points_are_those_of_each_frame() -> None:
    capture = recorded()
    stripped = strip_labels(capture, 3)
    assert stripped.labels == ("*1", "*2", "*3", "*4", "*5")
    assert not np.array_equal(stripped.positions, capture.positions)
    for frame in range(len(capture)):
        one, other = (c.points(frame)[0] for c in (stripped, capture))
        np.testing.assert_array_equal(one[np.lexsort(one.T)], other[np.lexsort(other.T)])
    np.testing.assert_array_equal(strip_labels(capture, 3).positions, stripped.positions)
    assert not np.array_equal(strip_labels(capture, 4).positions, stripped.positions)


@given(st.integers(1, 30), st.integers(0, 20), st.floats(0.01, 0.2), st.integers(0, 50))
@settings(max_examples=20, deadline=None)
def test_cut_stretches_have_the_lengths_and_measured_ends(shortest: int, more: int, share: float, seed: int) -> None:
    capture = recorded()
    cut = cut_stretches(capture, (shortest, shortest + more), share, seed)
    before, after = (np.isfinite(c.positions[..., 0]) for c in (capture, cut))
    lost = before & ~after
    np.testing.assert_array_equal(cut.positions[after], capture.positions[after])
    assert not lost[:, 3].any()
    assert share * before[:, [0, 1, 2, 4]].sum() <= lost.sum() < share * before.sum() + shortest + more
    for column in lost.T:
        edges = np.flatnonzero(np.diff(np.concatenate([[False], column, [False]]).astype(np.int8))).reshape(-1, 2)
        for start, stop in edges:
            assert shortest <= stop - start <= shortest + more
            assert start > 0
            assert stop < len(capture)


def test_commands_write_what_the_functions_return(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = tmp_path / "source.csv"
    write_capture(source, recorded())
    for name in ("one", "two"):
        assert main(["markers", "shuffle", str(source), "-o", str(tmp_path / f"{name}.csv"), "--seed", "3"]) == 0
    assert (tmp_path / "one.csv").read_bytes() == (tmp_path / "two.csv").read_bytes()
    np.testing.assert_allclose(
        read_capture(tmp_path / "one.csv").positions, strip_labels(recorded(), 3).positions, atol=1e-12
    )
    options = ("--frames", "5", "9", "--share", "10")
    assert main(["markers", "cut", str(source), "-o", str(tmp_path / "cut.csv"), *options]) == 0
    np.testing.assert_allclose(
        read_capture(tmp_path / "cut.csv").positions, cut_stretches(recorded(), (5, 9), 0.1, 0).positions, atol=1e-12
    )
    assert "samples cut in stretches of 5 to 9 frames" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("frames", "share", "message"),
    [
        ((0, 5), 0.1, "1 to 400 frames"),
        ((9, 5), 0.1, "found 9 to 5"),
        ((5, 9), 0.6, "at most 50 %"),
        ((5, 9), float("nan"), "above 0"),
        ((399, 400), 0.1, "cut a smaller share"),
    ],
)
def test_impossible_cuts_are_rejected(frames: tuple[int, int], share: float, message: str) -> None:
    with pytest.raises(InputError, match=message):
        cut_stretches(recorded(), frames, share, 0)

"""Test labels, gaps, units and rate, whatever format they come from."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.errors import InputError
from depthtrack.hand.pose import make_pose
from depthtrack.hand.shape import HandShape
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.formats.conditioning import METRES, to_capture
from depthtrack.markers.formats.stored_capture import StoredCapture
from depthtrack.markers.models.layout import load_layout


def stored(labels: tuple[str, ...] = ("a", "b"), **fields: Any) -> StoredCapture:
    positions = np.ones((3, 2, 3)) * 20.0
    positions[:, 1] = 45.0
    return StoredCapture(**{"labels": labels, "positions": positions, "rate": 100.0, "unit": "mm", **fields})


def measured(capture: MarkerCapture) -> list[list[bool]]:
    return np.asarray(np.isfinite(capture.positions).all(axis=-1)).tolist()


# Labels


@pytest.mark.parametrize(
    ("labels", "expected", "note"),
    [
        (("anna:thumb", "anna:index"), ("thumb", "index"), "the prefix 'anna:' is removed"),
        (("anna:left:thumb", "anna:left:index"), ("left:thumb", "left:index"), "the prefix 'anna:' is removed"),
        (("anna:thumb", "ben:thumb"), ("anna:thumb", "ben:thumb"), "prefixes of 2 subjects are kept"),
        (("anna:thumb", "*7"), ("thumb", "*7"), "the prefix 'anna:' is removed"),
        (("thumb", "thumb"), ("thumb", "thumb_2"), "1 trajectories are repeated"),
        (("thumb", ""), ("thumb", "*1"), "1 trajectories have no label"),
        (("thumb",), ("thumb", "*1"), "1 trajectories have no label"),
        (("thumb", "index", "ring", "x"), ("thumb", "index"), "2 labels have no trajectory"),
        (("Unlabeled 12", "Unlabelled_13"), ("*12", "*13"), ""),
        (("set:Unlabeled 12", "unidentified"), ("*12", "*1"), ""),
        ((" thu\x1b[mmb ", "index"), ("thu[mmb", "index"), ""),
    ],
)
def test_labels(labels: tuple[str, ...], expected: tuple[str, ...], note: str) -> None:
    capture = to_capture(stored(labels))
    assert capture.labels == expected
    assert any(note in each for each in capture.notes) or not note


@given(st.lists(st.sampled_from(["", "*", "*1", "*2", "a", "a_2", "a_3", "s:a", "t:a", "s:", ":a"]), max_size=9))
def test_any_labels_become_different_ones(labels: list[str]) -> None:
    capture = to_capture(stored(tuple(labels), positions=np.ones((1, 6, 3))))
    assert len(set(capture.labels)) == 6
    assert all(capture.labels)


# Gaps


def test_zeros_without_residual_are_gaps_and_noted() -> None:
    positions = stored().positions.copy()
    positions[1, 0] = 0
    positions[2, 1, 2] = np.nan
    capture = to_capture(stored(positions=positions))
    assert measured(capture) == [[True, True], [False, True], [True, False]]
    assert capture.notes == ("1 samples are 0 0 0 and are read as gaps",)


def test_zeros_with_a_residual_stay_and_negative_residuals_are_gaps() -> None:
    positions = stored().positions.copy()
    positions[:, 0] = 0
    residuals = np.array([[0.0, 0.5], [-1.0, -1.0], [np.nan, np.nan]])
    capture = to_capture(stored(positions=positions, residuals=residuals))
    assert measured(capture) == [[True, True], [False, False], [False, True]]
    assert capture.notes == (
        "1 samples are 0 0 0 and are read as gaps",
        "1 samples are 0 0 0 with a residual and are kept",
    )
    assert capture.residuals is not None
    np.testing.assert_allclose(capture.residuals, [[0, 0.0005], [np.nan, np.nan], [np.nan, np.nan]])


# Units and rate


@pytest.mark.parametrize("unit", METRES)
@pytest.mark.parametrize("layout", ["13", "16", "19", "26"])
@pytest.mark.parametrize("bend", [0.0, 1.2])
def test_the_unit_is_found_by_the_size_of_a_hand(unit: str, layout: str, bend: float) -> None:
    model = load_layout(layout, HandShape())
    pose = make_pose([0.4, 0.2, 0.5], [1, 0, 0, 0], np.tile([0, bend, bend, bend], 5))
    positions = model.positions(pose)[None]
    capture = to_capture(StoredCapture(model.labels, positions / METRES[unit], 100.0))
    assert capture.unit == unit
    np.testing.assert_allclose(capture.positions, positions)
    assert f"the file states no unit; {unit} is taken" in capture.notes[0]


@pytest.mark.parametrize(
    ("text", "unit"), [("Millimeters", "mm"), (" MM ", "mm"), ("Metres", "m"), ("centimeter", "cm")]
)
def test_names_of_units(text: str, unit: str) -> None:
    assert to_capture(stored(unit=text)).unit == unit


def test_an_unknown_unit_is_noted() -> None:
    capture = to_capture(stored(unit="furlong"))
    assert capture.unit == "mm"
    assert "the unit 'furlong' is unknown" in capture.notes[0]


def test_the_user_s_rate_and_unit_count() -> None:
    capture = to_capture(stored(), rate=50, unit="cm")
    assert (capture.rate, capture.unit, capture.positions[0, 0, 0]) == (50, "cm", 0.2)
    assert capture.notes == ("the unit is cm, as chosen", "the rate is 50 Hz, as chosen; the file states 100 Hz")


@pytest.mark.parametrize(
    ("options", "match"),
    [({"rate": 0.0}, "the rate must be"), ({"rate": np.nan}, "the rate must be"), ({"unit": "ft"}, "m, cm, mm")],
)
def test_unusable_options_are_refused(options: dict[str, Any], match: str) -> None:
    with pytest.raises(InputError, match=match):
        to_capture(stored(), **options)

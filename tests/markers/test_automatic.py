"""Labelling from a start in any frame joins both directions in order."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.markers import automatic
from depthtrack.markers.automatic import find_start, label_from
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.initialisation.started import StartedModel, StartedModels
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.labelling.options import LabellingOptions, OfflineOptions
from depthtrack.markers.models.marker_model import MarkerModel
from tests.support.markers import body_with_markers

MODEL = body_with_markers()


@pytest.fixture
def capture() -> MarkerCapture:
    """Three points whose x is the number of the frame; the second half has a fourth point."""
    positions = np.full((20, 4, 3), np.nan)
    positions[:, :3] = np.arange(20)[:, None, None]
    positions[10:, 3] = 99.0
    return MarkerCapture(100.0, ("*1", "*2", "*3", "*4"), positions)


def started(frame: int, confidence: float = 1.0) -> StartedModels:
    pose = np.array([float(frame), *np.zeros(2), 1.0, *np.zeros(23)])
    return StartedModels((StartedModel(MODEL, pose, np.arange(3), 0.0, 0.0, 1.0, confidence),), frame)


def label_by_column(
    capture: MarkerCapture,
    models: Sequence[MarkerModel],
    options: LabellingOptions | None = None,
    starts: Any = None,
) -> LabelledCapture:
    """Move the pose of the start as the points move, and label by columns."""
    moved = capture.positions[:, 0, 0] - capture.positions[0, 0, 0]
    poses = np.repeat(starts[0][None], len(capture), axis=0)
    poses[:, 0] += moved
    columns = np.tile(np.arange(3), (len(capture), 1))
    return LabelledCapture(capture, tuple(models), (columns,), (poses,), (np.ones(columns.shape),))


@pytest.mark.parametrize("frame", [0, 7, 19])
def test_both_directions_are_joined(frame: int, capture: MarkerCapture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(automatic, "label_capture", label_by_column)
    labelled = label_from(capture, [MODEL], started(frame))
    np.testing.assert_array_equal(labelled.poses[0][:, 0], np.arange(20))
    assert labelled.columns[0].shape == (20, 3)
    np.testing.assert_array_equal(labelled.positions(0), capture.positions[:, :3])


def test_online_labels_nothing_before_the_start(capture: MarkerCapture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(automatic, "label_capture", label_by_column)
    online = LabellingOptions(offline=OfflineOptions(use=False))
    labelled = label_from(capture, [MODEL], started(7), online)
    assert np.all(labelled.columns[0][:7] == -1)
    assert np.isnan(labelled.poses[0][:7]).all()
    np.testing.assert_array_equal(labelled.poses[0][7:, 0], np.arange(7, 20))


def test_the_most_certain_start_is_taken(capture: MarkerCapture, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[float] = []

    def initialise(points: np.ndarray, models: object, options: object) -> StartedModels:
        seen.append(points[0, 0])
        return started(0, confidence=0.5 + 0.01 * points[0, 0])

    monkeypatch.setattr(automatic, "initialise", initialise)
    found = find_start(capture, [MODEL], frames=4)
    assert seen[0] == 0
    assert len(seen) == len(set(seen)) <= 4
    assert found.frame == max(seen) > 0


def test_a_certain_start_ends_the_search(capture: MarkerCapture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(automatic, "initialise", lambda points, models, options: started(0))
    shown: list[float] = []
    assert find_start(capture, [MODEL], progress=lambda step, share: shown.append(share)).frame == 0
    assert shown == [0.0]


def test_models_that_are_nowhere_are_named(capture: MarkerCapture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(automatic, "initialise", lambda *_: StartedModels((None,)))
    with pytest.raises(InputError, match="none of the models box is found in 7 frames"):
        find_start(replace(capture), [MODEL])

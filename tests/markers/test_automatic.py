"""The start of a labelling: the most certain of a few frames."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.markers import automatic
from depthtrack.markers.automatic import find_start, label_from, sized_models
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.initialisation.started import StartedModel, StartedModels
from depthtrack.markers.labelling.options import LabellingOptions
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.markers.models.model_choice import choose_models
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


def test_labelling_begins_with_the_pose_and_the_frame_of_the_start(
    capture: MarkerCapture, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[tuple[Any, ...]] = []
    monkeypatch.setattr(automatic, "label_capture", lambda *arguments: calls.append(arguments))
    steps: list[str] = []
    monkeypatch.setattr(automatic, "exchange_markers", lambda labelled, options: steps.append("exchange"))
    monkeypatch.setattr(automatic, "fit_poses", lambda labelled, options: steps.append("fit"))
    monkeypatch.setattr(automatic, "initialise", lambda points, models: StartedModels((*started(0).models, None)))
    begin, options = started(7), LabellingOptions()
    other = body_with_markers()
    models = sized_models([other, other], StartedModels((*begin.models, None), 7))
    assert models == (MODEL, other)
    label_from(capture, models, StartedModels((*begin.models, None), 7), options)
    ((given, found, chosen, poses, starter, frame),) = calls
    assert (given, found, chosen, frame) == (capture, models, options, 7)
    assert poses[0] is begin.found[0].pose
    assert poses[1] is None
    assert steps == ["exchange", "fit"]
    assert [pose is None for pose in starter(np.zeros((3, 3)), models)] == [False, True]


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


@pytest.mark.parametrize("side", ["right", "left"])
def test_an_open_side_becomes_the_one_with_less_energy(
    side: str, capture: MarkerCapture, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried: list[str] = []

    def initialise(points: np.ndarray, models: tuple[MarkerModel, ...], options: object) -> StartedModels:
        tried.append(models[0].name)
        energy = 3.0 if models[0].name == side else 9.0
        return StartedModels((replace(started(0).found[0], model=models[0], energy=energy),))

    monkeypatch.setattr(automatic, "initialise", initialise)
    found = find_start(capture, choose_models(["13"]))
    assert found.found[0].model.name == side
    assert not found.found[0].model.open_side
    # A difference of 6 in each frame decides after two of them.
    assert tried == ["right", "left", "right", "left"]


def test_models_that_are_nowhere_are_named(capture: MarkerCapture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(automatic, "initialise", lambda *_: StartedModels((None,)))
    with pytest.raises(InputError, match=r"no model .box. was found in 7 frames"):
        find_start(replace(capture), [MODEL])

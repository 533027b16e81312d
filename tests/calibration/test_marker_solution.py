"""Solving of a capture: labels of the file or found ones, calibrated or not."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from depthtrack.calibration import marker_solution
from depthtrack.calibration.marker_solution import solve_capture
from depthtrack.errors import InputError
from depthtrack.hand.shape import HandShape, Side
from depthtrack.markers.initialisation.started import StartedModels
from depthtrack.markers.labelled_fit import fit_poses
from depthtrack.markers.models.model_choice import choose_models
from depthtrack.synthesis.marker_capture import MarkerSynthesis, SyntheticMarkers, synthesise_markers


@pytest.fixture(scope="module")
def made() -> SyntheticMarkers:
    return synthesise_markers(MarkerSynthesis(frames=60, rate=60.0, rigid_bodies=1, seed=4))


def test_labels_of_the_file_give_sizes_and_closer_markers(made: SyntheticMarkers) -> None:
    capture = made.truth.labelled()
    plain = solve_capture(capture, made.models, calibrate="never")
    solved = solve_capture(capture, made.models)
    assert not plain.calibrated
    assert list(solved.sizes()) == ["right"]
    length, sd = solved.sizes()["right"]["hand_length"]
    assert 0.12 < length < 0.26
    assert 0 < sd < 0.02
    before, after = (np.nanmean(each.labelled.residuals(0)) for each in (plain, solved))
    assert after < 0.6 * before
    np.testing.assert_array_equal(solved.labelled.positions(0), made.truth.positions(0))


def test_found_labels_are_found_again_with_the_calibrated_models(
    made: SyntheticMarkers, monkeypatch: pytest.MonkeyPatch
) -> None:
    used: list[Any] = []

    def label(capture: object, models: Any, started: object, options: object) -> Any:
        used.append(models)
        return fit_poses(made.truth)

    monkeypatch.setattr(marker_solution, "label_from", label)
    steps: list[str] = []
    started = StartedModels((None, None))
    found = solve_capture(made.capture, made.models, started=started, progress=lambda step, share: steps.append(step))
    assert used[0] == made.models
    assert used[1][0] is found.calibrated["right"].model
    assert used[1][1] is made.truth.models[1]
    assert found.started is started
    assert steps == ["labelling", "sizes of right", "poses"]


def test_labels_that_must_be_there_are_missed(made: SyntheticMarkers) -> None:
    with pytest.raises(InputError, match="lacks labels of right, body1"):
        solve_capture(made.capture, made.models, labels="file")


def test_few_frames_are_measured_only_if_they_must_be(made: SyntheticMarkers) -> None:
    capture = made.truth.labelled().between(0, 4)
    assert not solve_capture(capture, made.models, calibrate="if possible").calibrated
    with pytest.raises(InputError, match="a calibration needs"):
        solve_capture(capture, made.models)


@pytest.mark.parametrize("side", ["right", "left"])
def test_labels_give_an_open_side(side: Side) -> None:
    synthesis = MarkerSynthesis(motion="grasp", layout="13", hand=HandShape(side=side), frames=40, rate=40.0, seed=5)
    capture = synthesise_markers(synthesis).truth.labelled()
    models = choose_models(["13"])
    found = solve_capture(capture, models, calibrate="never")
    assert found.labelled.models[0].name == side
    assert found.measured_sides(models) == [side]


def test_final_poses_depend_on_the_labels_alone(made: SyntheticMarkers) -> None:
    fitted = fit_poses(made.truth)
    moved = tuple(poses + 0.01 for poses in made.truth.poses)
    again = fit_poses(replace(made.truth, poses=moved))
    for before, after in zip(fitted.poses, again.poses, strict=True):
        np.testing.assert_array_equal(before, after)

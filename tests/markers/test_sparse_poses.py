"""Poses of hands with few markers, by the synergies of their layout."""

import json
from dataclasses import replace

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.hand.pose import ANGLES, make_pose
from depthtrack.hand.shape import HandShape
from depthtrack.hand.synergies import Synergies
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.layout.manual import manual_layout
from depthtrack.markers.models.layout import Layout, load_layout
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.markers.models.model_choice import with_synergies
from depthtrack.markers.sparse_poses import is_sparse, with_likely_postures
from depthtrack.types import Array


@pytest.fixture(scope="module")
def motion() -> Array:
    """Poses (40, 27) whose fingers close together."""
    angles = np.linspace(0, 1, 40)[:, None] * np.tile([0.0, 0.8, 0.9, 0.5], 5) + 0.05
    return make_pose(np.zeros(3), [1.0, 0, 0, 0], angles)


def test_layouts_with_a_marker_a_finger_are_sparse() -> None:
    assert is_sparse(manual_layout("4F-1T").on(HandShape()))
    assert not is_sparse(load_layout("13", HandShape()))


def test_the_synergies_of_a_layout_reach_its_model(motion: Array) -> None:
    layout = replace(manual_layout("4F-1T"), synergies=Synergies.fit(motion[:, ANGLES]))
    again = Layout.from_fields(json.loads(layout.to_json())).on(HandShape())
    assert again.synergies is not None
    model = MarkerModel.from_fields(json.loads(again.to_json()))
    assert model.synergies is not None
    np.testing.assert_allclose(model.synergies.mean, motion[:, ANGLES].mean(axis=0), atol=1e-7)
    assert with_synergies([model], "auto")[0].synergies is model.synergies
    assert with_synergies([model], "none")[0].synergies is None
    bare = model.with_(synergies=None)
    assert with_synergies([bare], "auto")[0].synergies is not None
    assert with_synergies([load_layout("13", HandShape())], "auto")[0].synergies is None
    with pytest.raises(InputError, match="no synergies 'nonsense'"):
        with_synergies([model], "nonsense")


def test_fingers_without_markers_follow_the_others(motion: Array) -> None:
    model = manual_layout("4F-2T").on(HandShape()).part(np.array([0, 1, 2, 5]))
    model = model.with_(synergies=Synergies.fit(motion[:, ANGLES]))
    positions = model.positions(motion)
    capture = MarkerCapture(100.0, model.labels, positions)
    straight = np.repeat(motion[:1], 40, axis=0)
    straight[7] = np.nan
    columns = np.tile(np.arange(4), (40, 1))
    labelled = LabelledCapture(capture, (model,), (columns,), (straight,), (np.ones((40, 4)),))
    (poses,) = with_likely_postures(labelled).poses
    seen = np.arange(40) != 7
    assert np.isnan(poses[7]).all()
    assert np.abs(poses[seen, 15:19] - motion[seen, 15:19]).max() < 0.25
    (same,) = with_likely_postures(replace(labelled, models=(model.with_(synergies=None),))).poses
    np.testing.assert_array_equal(same, straight)

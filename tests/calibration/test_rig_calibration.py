"""The scale of a rigged hand, measured on a few views of it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from depthtrack.calibration.rig_calibration import RigCalibration, calibrate_rig, depth_disagreement
from depthtrack.errors import InputError
from depthtrack.hand.hand_file import load_hand
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.hand_surface import HandSurface
from depthtrack.rendering.raster import RasterScorer
from depthtrack.segmentation.observation import Observation
from depthtrack.synthesis.generate import Synthesis
from depthtrack.synthesis.observations import ObservedMotion

TRUE_SCALE = 0.92
VIEWS = (0, 20, 40, 60, 90, 120)


@pytest.fixture(scope="module")
def rig(own_glb: Path) -> HandShape:
    return load_hand(own_glb)


@pytest.fixture(scope="module")
def motion(rig: HandShape) -> ObservedMotion:
    return ObservedMotion(Synthesis(hand=rig.with_(scale=TRUE_SCALE), model="skin"))


@pytest.fixture(scope="module")
def views(motion: ObservedMotion) -> list[Observation]:
    return [motion[index] for index in VIEWS]


@pytest.fixture(scope="module")
def calibration(views: list[Observation], rig: HandShape) -> RigCalibration:
    return calibrate_rig(views, rig, RasterScorer)


@pytest.mark.slow
def test_the_scale_of_a_rig_is_found(calibration: RigCalibration, rig: HandShape, tmp_path: Path) -> None:
    assert calibration.hand.scale == pytest.approx(TRUE_SCALE, abs=0.015)
    assert calibration.hand.rig == rig.rig
    assert calibration.after < 0.5 * calibration.before
    assert calibration.side_margin > 0.1
    file = tmp_path / "hand.json"
    file.write_text(calibration.to_json())
    assert load_hand(file) == calibration.hand


@pytest.mark.slow
def test_a_hand_of_the_other_side_is_rejected(views: list[Observation], rig: HandShape) -> None:
    with pytest.raises(InputError, match="must show a left hand like the rig"):
        calibrate_rig(views, rig.with_(side="left"), RasterScorer)


def test_sizes_without_a_rig_are_rejected(views: list[Observation]) -> None:
    with pytest.raises(InputError, match="must be a rigged mesh"):
        calibrate_rig(views, HandShape(), RasterScorer)


def test_the_disagreement_is_least_for_the_true_hand(motion: ObservedMotion, rig: HandShape) -> None:
    observation, pose = motion[VIEWS[0]], motion.poses[VIEWS[0]]
    costs = [
        depth_disagreement(HandSurface.of(rig.with_(scale=TRUE_SCALE * factor), skin=True), observation, pose)
        for factor in (0.9, 1.0, 1.1)
    ]
    assert costs[1] < 0.02
    assert min(costs[0], costs[2]) > 5 * costs[1]
    away = pose + np.append([0.3, 0, 0], np.zeros(24))
    assert depth_disagreement(HandSurface.of(rig, skin=True), observation, away) == 1
    # Pixels without a reading, but inside the silhouette, agree.
    blind = replace(observation, depth=np.zeros_like(observation.depth))
    assert depth_disagreement(HandSurface.of(rig.with_(scale=TRUE_SCALE), skin=True), blind, pose) < 0.02

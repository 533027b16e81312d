"""What an object hides of the posed hand is no error of the silhouette."""

from dataclasses import replace

import numpy as np

from depthtrack.evaluation.residuals import frame_residuals, visible_silhouette
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.hand_surface import HandSurface
from depthtrack.synthesis.generate import Synthesis
from depthtrack.synthesis.observations import ObservedMotion
from depthtrack.synthesis.sensors import make_sensor


def test_hidden_pixels_are_left_out() -> None:
    motion = ObservedMotion(Synthesis("everyday", frames=1))
    observation, pose = motion[0], motion.poses[0]
    surface, camera = HandSurface.of(HandShape(), skin=False), make_sensor("ideal").camera
    covered = np.arange(observation.camera.width) >= observation.camera.width // 2
    seen = replace(
        observation, silhouette=observation.silhouette & ~covered, depth=np.where(covered, 0, observation.depth)
    )
    before = np.where(covered, 0.3, np.zeros(seen.camera.shape)).astype(np.float32)
    held = replace(seen, occluder=before)
    assert visible_silhouette(surface, pose, seen, camera).sum() == surface.silhouette(pose, camera).sum()
    _, e2d, iou = frame_residuals(surface, pose, held, camera)
    assert (e2d, iou) == (0, 1)
    _, e2d, iou = frame_residuals(surface, pose, seen, camera)
    assert e2d > 1
    assert iou < 0.8
    behind = replace(seen, occluder=before * 3)
    assert frame_residuals(surface, pose, behind, camera)[1] == e2d

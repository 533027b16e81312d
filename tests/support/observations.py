"""Observations of synthetic frames by a perfect segmentation, for the tests of trackers."""

import numpy as np

from depthtrack.segmentation.hand_size import AVERAGE_HAND
from depthtrack.segmentation.morphology import bounding_box
from depthtrack.segmentation.observation import Observation
from depthtrack.synthesis.generate import Synthesiser


def observe(made: Synthesiser, index: int, room: float = 0.03) -> Observation:
    """The true hand of frame `index` in a region with `room` metres around it."""
    frame, camera = made[index], made.sensor.camera
    region = bounding_box(frame.mask, int(room * camera.fx / made.distance))
    depth = np.where(frame.mask, frame.depth, 0)[region.slices].astype(np.float32)
    cropped = camera.crop(region)
    v, u = np.nonzero(depth)
    centre = np.median(cropped.unproject(np.stack([u, v], axis=-1), depth[v, u]), axis=0) + np.array(
        [0, 0, AVERAGE_HAND.palm_half_thickness]
    )
    return Observation(
        cropped, frame.mask[region.slices], depth, index, frame.timestamp, region, centre, palm_radius=0.04
    )

"""Observations of synthetic frames as a perfect segmentation would make them, for tests of trackers."""

import numpy as np

from depthtrack.segmentation.observation import Observation
from depthtrack.synthesis.generate import Synthesiser


def observe(made: Synthesiser, index: int, room: float = 0.03) -> Observation:
    """The true hand of frame `index` in a window with `room` metres around it."""
    frame, camera = made[index], made.sensor.camera
    rows, columns = np.nonzero(frame.mask)
    pad = int(room * camera.fx / made.distance)
    left, top = max(int(columns.min()) - pad, 0), max(int(rows.min()) - pad, 0)
    right = min(int(columns.max()) + pad + 1, camera.width)
    bottom = min(int(rows.max()) + pad + 1, camera.height)
    window = (slice(top, bottom), slice(left, right))
    depth = np.where(frame.mask, frame.depth, 0)[window].astype(np.float32)
    cropped = camera.crop(left, top, right - left, bottom - top)
    v, u = np.nonzero(depth)
    centre = np.median(cropped.unproject(np.stack([u, v], axis=-1), depth[v, u]), axis=0) + np.array([0, 0, 0.0145])
    return Observation(
        index, frame.timestamp, cropped, (left, top), frame.mask[window].copy(), depth, centre, palm_radius=0.04
    )

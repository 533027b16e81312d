"""Observations of synthetic recordings without segmentation.

See Oikonomidis et al. 2011, Sec. 3.
Skin mask and depth come from the renderer, with the noise that an experiment adds. The region of interest is the true
hand's bounding box with the margin that segmentation uses.
"""

from dataclasses import replace
from functools import cached_property, lru_cache
from threading import Lock

import numpy as np

from depthtrack.hand.shape import HandShape
from depthtrack.segmentation.hand_size import HandSize
from depthtrack.segmentation.morphology import bounding_box
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.options import RoiOptions
from depthtrack.synthesis.generate import Synthesis, Synthesiser, SyntheticFrame
from depthtrack.types import Array

MOTIONS_KEPT = 1
"""Motions whose observations a process keeps; 360 frames at 0.5 m take 160 MB.

Experiments evaluate one condition after another, and joblib restarts a worker that grows by 300 MB.
"""


class ObservedMotion:
    """Observations of a synthetic recording, synthesised at first access and cached."""

    def __init__(self, recording: Synthesis) -> None:
        self.recording = recording
        self._observations: dict[int, Observation] = {}
        self._lock = Lock()

    @property
    def hand(self) -> HandShape:
        """Return the true hand, whose sizes are exact."""
        return self.recording.hand.with_(uncertainty=0.0)

    @property
    def poses(self) -> Array:
        """Return the true poses (T, 27), camera frame."""
        return self._synthesiser.poses

    def __len__(self) -> int:
        return len(self._synthesiser)

    def __getitem__(self, index: int) -> Observation:
        with self._lock:
            if index not in self._observations:
                self._observations[index] = observation_of(self._synthesiser[index], self._synthesiser, index)
            return self._observations[index]

    def uncached(self, index: int) -> Observation:
        """Return a copy whose point cloud is not computed yet, for timing and to save memory."""
        return replace(self[index])

    @cached_property
    def _synthesiser(self) -> Synthesiser:
        return Synthesiser(self.recording)


def observation_of(frame: SyntheticFrame, synthesiser: Synthesiser, index: int) -> Observation:
    """Return the observation of a frame that shows a hand without a background."""
    camera, hand = synthesiser.sensor.camera, synthesiser.options.hand
    distance = float(np.median(frame.exact_depth[frame.mask]))
    region = bounding_box(frame.mask, round(RoiOptions().margin * camera.fx / distance))
    roi = camera.crop(region)
    depth = np.ascontiguousarray(frame.depth[region.slices], dtype=np.float32)
    v, u = np.nonzero(depth)
    surface = np.median(roi.unproject(np.stack([u, v], axis=-1), depth[v, u]), axis=0)
    inwards = surface / np.linalg.norm(surface)
    return Observation(
        frame_index=index,
        timestamp=frame.timestamp,
        camera=roi,
        region=region,
        silhouette=frame.skin[region.slices],
        depth=depth,
        centre=surface + HandSize.of(hand).palm_half_thickness * inwards,
        palm_radius=hand.palm_breadth * hand.scale / 2,
    )


@lru_cache(maxsize=MOTIONS_KEPT)
def observed_motion(recording: Synthesis) -> ObservedMotion:
    """Return the observations of a recording; the process keeps those of the last one."""
    return ObservedMotion(recording)

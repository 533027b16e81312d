"""What experiments on synthetic data observe: rendered skin and depth maps, as in Sec. 3 of Oikonomidis et al. 2011.

No colour is segmented: the maps are the renderer's, with whatever noise the experiment adds. The region of interest
lies around the true hand, with the room that a segmentation would leave.
"""

from dataclasses import replace
from functools import cached_property, lru_cache
from threading import Lock

import numpy as np

from depthtrack.hand.shape import HandShape
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.roi_tracking import ROI_MARGIN, bounding_box
from depthtrack.synthesis.generate import Synthesis, Synthesiser, SyntheticFrame
from depthtrack.types import Array

MOTIONS_KEPT = 1
"""A motion of 360 frames at half a metre takes 160 MB: experiments go through their conditions one after another, and a
worker that grows by 300 MB is taken for leaking."""


class ObservedMotion:
    """Observations of a synthetic recording, each made when first asked for and kept; true poses (T, 27)."""

    def __init__(self, recording: Synthesis) -> None:
        self.recording = recording
        self._observations: dict[int, Observation] = {}
        self._lock = Lock()

    @property
    def hand(self) -> HandShape:
        return self.recording.hand

    @property
    def poses(self) -> Array:
        return self._made.poses

    def __len__(self) -> int:
        return len(self._made)

    def __getitem__(self, index: int) -> Observation:
        with self._lock:
            if index not in self._observations:
                self._observations[index] = observe(self._made[index], self._made, index)
            return self._observations[index]

    def again(self, index: int) -> Observation:
        """As if observed anew: its point cloud is yet to be made, and does not stay in memory."""
        return replace(self[index])

    @cached_property
    def _made(self) -> Synthesiser:
        return Synthesiser(self.recording)


def observe(frame: SyntheticFrame, made: Synthesiser, index: int) -> Observation:
    """The observation of a frame that shows a hand and nothing behind it."""
    camera, hand = made.sensor.camera, made.options.hand
    region = bounding_box(frame.mask, round(ROI_MARGIN * camera.fx / float(np.median(frame.exact_depth[frame.mask]))))
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
        centre=surface + hand.palm_thickness * hand.scale / 2 * inwards,
        palm_radius=hand.palm_breadth * hand.scale / 2,
    )


@lru_cache(maxsize=MOTIONS_KEPT)
def observed_motion(recording: Synthesis) -> ObservedMotion:
    """Return the observations of a recording, from a cache of the last one."""
    return ObservedMotion(recording)

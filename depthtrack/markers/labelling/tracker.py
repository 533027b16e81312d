"""Online labelling: points in, labels and poses out, frame by frame."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.markers.labelling.confidence import ONLINE, confidence
from depthtrack.markers.labelling.options import LabellingOptions
from depthtrack.markers.labelling.scene import Scene
from depthtrack.markers.labelling.state import FrameLabels, Settings, TrackState
from depthtrack.markers.labelling.step import track_frame
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array, Index, Mask

Starter = Callable[[Array, tuple[MarkerModel, ...]], tuple[Array | None, ...]]
"""Initialisation: points (K, 3), metres, and models to a pose (27,) of each one; None where it is not found."""

HELD = 0.005
"""Distance from a marker of a tracked model within which a point is not offered to others, metres."""


@dataclass(frozen=True)
class LabelledFrame:
    """Labels and poses of a frame; a tuple has an entry for each model, of M markers.

    points: (M,) number of the point of each marker; -1 if it has none.
    poses: (G, 27) capture frame, metres and radians; NaN while a model is lost.
    errors: (M,) distance of each point from its model, metres; NaN without a point.
    confidence: (M,) probability that the label is right; NaN without a point.
    """

    points: tuple[Index, ...]
    poses: Array
    errors: tuple[Array, ...]
    confidence: tuple[Array, ...]


def restart(points: Array, scene: Scene, models: Sequence[MarkerModel], state: TrackState, starter: Starter) -> None:
    """Start the models that are not tracked where a starter finds them in the other points.

    points: (K, 3) metres. Those near the markers of tracked models are left out.
    """
    lost = np.flatnonzero(~state.active)
    tracked = [model.positions(pose) for model, pose, on in zip(models, state.pose, state.active, strict=True) if on]
    held = np.concatenate([np.empty((0, 3)), *tracked])
    distance = np.linalg.norm(points[:, None] - held, axis=-1).min(axis=1, initial=np.inf)
    found = starter(points[distance > HELD], tuple(models[int(g)] for g in lost))
    for g, pose in zip(lost, found, strict=True):
        if pose is not None:
            state.start(scene, int(g), pose)


class MarkerTracker:
    """Causal labelling of several models.

    tracker = MarkerTracker(models, rate=200.0, starts=poses)
    for points in frames: frame = tracker.update(points)
    """

    def __init__(
        self,
        models: Sequence[MarkerModel],
        rate: float,
        options: LabellingOptions | None = None,
        starts: Sequence[Array | None] | None = None,
        starter: Starter | None = None,
    ) -> None:
        """Prepare to track.

        rate: Hz.
        starts: pose (27,) of each model in the first frame; None for one that is not known.
        starter: initialisation of models that are not tracked; None: they stay lost.
        """
        self.models, self._starter = tuple(models), starter
        self._scene = Scene.of(models)
        self._settings = Settings.of(options or LabellingOptions(), rate)
        self.state = TrackState.empty(self._scene)
        self._frame, self._next_search = 0, 0
        self._out = FrameLabels.empty(len(self._scene.body))
        self._slices = [slice(a, b) for a, b in zip(self._scene.first[:-1], self._scene.first[1:], strict=True)]
        for g, pose in enumerate(starts or ()):
            if pose is not None:
                self.state.start(self._scene, int(g), pose)

    @property
    def is_tracked(self) -> Mask:
        """Whether each model (G,) is tracked."""
        return self.state.active.copy()

    def update(self, points: ArrayLike) -> LabelledFrame:
        """Label the points (K, 3) of the next frame, metres, capture frame; all finite."""
        x = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 3)
        if self._starter is not None and not self.state.active.all() and self._frame >= self._next_search:
            restart(x, self._scene, self.models, self.state, self._starter)
            self._next_search = self._frame + self._settings.retry_frames
        self._frame += 1
        track_frame(x, self._scene, self._settings, self.state, self._out)
        out = self._out
        poses = np.where(self.state.active[:, None], self.state.pose, np.nan)

        def split(values: Array) -> tuple[Array, ...]:
            return tuple(values[part].copy() for part in self._slices)

        return LabelledFrame(
            tuple(out.point[part].copy() for part in self._slices),
            poses,
            split(out.error),
            split(confidence(out.features, ONLINE)),
        )

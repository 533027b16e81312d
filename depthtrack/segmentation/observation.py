"""The observation of a frame: silhouette, depth and point cloud of the hand."""

import math
from collections.abc import Callable, Hashable, Iterator
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, TypeVar, cast

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.recording.sequence import ImageKeypoints
from depthtrack.rendering.target import Target
from depthtrack.segmentation.options import PointCloudOptions
from depthtrack.segmentation.point_cloud import count_readings, point_cloud
from depthtrack.segmentation.wrist import WristPlane
from depthtrack.types import Array, Mask

Made = TypeVar("Made")


class Resegmentation(Protocol):
    """Segments the frame of a start anew. The state of the segmenter stays."""

    def elsewhere(self) -> "Iterator[Observation]":
        """Yield observations of other places of the hand, with their costs."""
        ...

    def around(self, pose: Array) -> "Observation | None":
        """Return the observation near a pose (27,), or None with too few readings there."""
        ...


@dataclass(frozen=True)
class Observation(Target):
    """The hand in a frame: a target for scorers with position, palm and point cloud.

    It is made once per frame and shared by all trackers.

    region: region of interest in the frame, imaged by `camera`.
    frame_camera: camera of the whole frame; None if unknown.
    centre: (3,) approximate centre of the palm, metres, camera frame.
    palm_radius: of the circle inscribed in the palm, metres.
    arm_direction: (3,) unit vector from the palm along the forearm, camera frame; None without a visible arm.
    wrist: plane where the forearm is cut off, if any.
    cloud_options: options of the point cloud.
    keypoints: of the hand in the region, from elsewhere; None if there are none.
    arrived: time of `time.perf_counter` at which the frame arrived, seconds; NaN if unknown.
    resegmentation: makes other observations of the same frame, for a start; None if a prior was used.
    cost: of an observation elsewhere beside the first one, as a distance, metres.
    """

    frame_index: int
    timestamp: float
    region: Rect
    centre: Array
    palm_radius: float
    arm_direction: Array | None = None
    wrist: WristPlane | None = None
    cloud_options: PointCloudOptions | None = None
    keypoints: ImageKeypoints | None = None
    arrived: float = math.nan
    resegmentation: Resegmentation | None = None
    cost: float = 0.0
    frame_camera: Camera | None = None

    def arrived_at(self, arrived: float) -> "Observation":
        """Return the observation with another time of arrival; its maps are not checked again."""
        other = copy(self)
        object.__setattr__(other, "arrived", arrived)
        return other

    def whole_mask(self, shape: tuple[int, ...]) -> Mask:
        """Return the silhouette in the whole frame of `shape` (height, width)."""
        return self.region.paste(self.silhouette, Rect.of_image(shape))

    def whole_occluder(self, shape: tuple[int, ...]) -> Mask | None:
        """Return the object that may hide the hand in the whole frame of `shape` (height, width)."""
        return None if self.occluder is None else self.region.paste(self.occluder > 0, Rect.of_image(shape))

    @property
    def points(self) -> Array:
        """Points (N, 3) of the visible hand in metres, camera frame, row by row of the region."""
        return self.subsampled_cloud(1)[0]

    @property
    def normals(self) -> Array:
        """Unit normals (N, 3) of the points, towards the camera."""
        return self.subsampled_cloud(1)[1]

    @cached_property
    def reading_count(self) -> int:
        """Number of pixels with a reading, and of `points`."""
        return count_readings(self.depth)

    def subsampled_cloud(self, every: int) -> tuple[Array, Array]:
        """Return every n-th point (N, 3) and its normal, from the middle of the first n."""
        return self.shared(("points", every), lambda: point_cloud(self.camera, self.depth, self.cloud_options, every))

    def shared(self, key: Hashable, make: Callable[[], Made]) -> Made:
        """Return what `make` returned first for a key.

        It must depend on the observation and the key alone.
        """
        if key not in self._made:
            self._made.setdefault(key, make())
        return cast(Made, self._made[key])

    @cached_property
    def _made(self) -> dict[Hashable, object]:
        return {}

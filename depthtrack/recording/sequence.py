"""The protocol of recordings: frames one at a time, a camera, ground truth if it exists."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, Protocol

import numpy as np

from depthtrack.geometry.camera import Camera
from depthtrack.hand.benchmark_joints import Benchmark
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape, Side
from depthtrack.types import Array, Depth, Image, Mask


@dataclass(frozen=True)
class ImageKeypoints:
    """The 21 keypoints of a hand in an image, from any detector, in MediaPipe's order.

    pixels: (21, 2) column and row, of the depth image; NaN if unknown.
    confidence: (21,) 0 to 1; 0 if unknown.
    side: side of the hand by the detector, None if unknown.
    """

    pixels: Array
    confidence: Array
    side: Side | None = None

    def shifted(self, left: float, top: float) -> "ImageKeypoints":
        """Return the keypoints in the part of the image whose first pixel is (left, top)."""
        return replace(self, pixels=self.pixels - [left, top])


@dataclass(frozen=True)
class Frame:
    """One RGB-D frame.

    timestamp: seconds.
    depth: (h, w) float32, metres along the optical axis, 0 = no reading.
    colour: (h, w, 3) uint8 RGB registered to the depth, or None.
    keypoints: of the hand in the depth image, from elsewhere; None if there are none.
    """

    index: int
    timestamp: float
    depth: Depth
    colour: Image | None
    camera: Camera
    keypoints: ImageKeypoints | None = None


@dataclass(frozen=True)
class BenchmarkJoints:
    """Annotated joints of a benchmark whose skeleton differs from the 21 keypoints.

    positions: (T, J, 3) metres, world frame, in the order of `benchmark.joints`; NaN if unknown.
    """

    benchmark: Benchmark
    positions: Array


@dataclass(frozen=True)
class GroundTruth:
    """The annotations of a recording; `poses` or `joints` may be absent.

    timestamps: (T,) of the annotated frames, seconds, increasing.
    poses: (T, 27) of `hand`, metres, quaternion, radians, world frame.
    joints: (T, 21, 3) keypoints, metres, world frame, MediaPipe order; NaN if unknown.
    benchmark: joints of another skeleton, with which runs are compared by name; None without any.

    The world frame is that of `Sequence.T_camera_world`: the camera frame of depth cameras.

    Frames and annotations need not correspond one to one: `at` finds the annotation of a frame by its timestamp.
    """

    timestamps: Array
    poses: Array | None = None
    joints: Array | None = None
    hand: HandShape | None = None
    benchmark: BenchmarkJoints | None = None

    def at(self, timestamp: float, tolerance: float = 1e-3) -> int | None:
        """Return the row of the annotation within `tolerance` (s) of `timestamp`, or None."""
        after = int(np.searchsorted(self.timestamps, timestamp))
        rows = [row for row in (after - 1, after) if 0 <= row < len(self.timestamps)]
        nearest = min(rows, key=lambda row: abs(self.timestamps[row] - timestamp), default=None)
        return nearest if nearest is not None and abs(self.timestamps[nearest] - timestamp) <= tolerance else None

    def keypoints_at(self, timestamp: float) -> Array | None:
        """Return the annotated keypoints (21, 3), or those of the pose; metres, world frame."""
        row = self.at(timestamp)
        if row is None:
            return None
        if self.joints is not None:
            return self.joints[row]
        if self.poses is not None and self.hand is not None:
            return HandModel(self.hand).keypoints(self.poses[row])
        return None


OnDamage = Literal["refuse", "skip"]
"""The action of iteration at a frame that cannot be read: raise DamagedFrameError, or skip and record it."""


@dataclass(frozen=True)
class DamagedFrame:
    """A skipped frame: its index, its time (seconds) and the reason in one sentence."""

    index: int
    timestamp: float
    reason: str


class Sequence(Protocol):
    """A recording. Frames are read one at a time, so memory does not grow with the length.

    The length counts all frames of the recording. `sequence[i]` raises DamagedFrameError if frame i cannot be read.
    Iteration raises it too, or skips the frame and adds it to `damaged`, as chosen at opening. The `index` of a frame
    is its place in the recording in both cases.
    """

    T_camera_world: Array
    """Transform (4, 4), metres, to the camera frame from the frame of ground truth and runs.

    It is the identity for depth cameras, whose frame both share. A motion capture has a frame of its own, and a camera
    only for pictures.
    """

    @property
    def name(self) -> str: ...

    @property
    def camera(self) -> Camera: ...

    @property
    def timestamps(self) -> Array: ...

    @property
    def has_depth(self) -> bool:
        """Whether the frames have depth images; those of a recording without any are empty."""
        ...

    @property
    def has_colour(self) -> bool:
        """Whether any frame has colour; no image is decoded."""
        ...

    @property
    def hand(self) -> HandShape | None:
        """Sizes of the recorded hand, if the recording states them."""
        ...

    @property
    def ground_truth(self) -> GroundTruth | None: ...

    @property
    def description(self) -> Mapping[str, Any]:
        """How the recording was made (sensor, motion, seed, ...); may be empty."""
        ...

    @property
    def notes(self) -> list[str]:
        """What a user must know about how the recording is read, one sentence each.

        Commands print them.
        """
        ...

    @property
    def damaged(self) -> list[DamagedFrame]:
        """The frames skipped so far, in order."""
        ...

    @property
    def damaged_colour(self) -> list[DamagedFrame]:
        """The frames read so far whose colour cannot be read, in order; their depth can."""
        ...

    def __len__(self) -> int: ...

    def __getitem__(self, index: int) -> Frame: ...

    def __iter__(self) -> Iterator[Frame]: ...

    def frames(self, indices: Iterable[int]) -> Iterator[Frame]:
        """Yield some of the frames; damaged ones are treated as by iteration.

        Raises:
            InputError: if no frame can be read.
        """
        ...

    def hand_mask(self, index: int) -> Mask | None:
        """Return the true silhouette (h, w) of the hand without forearm; None if there is none."""
        ...

    def exact_depth(self, index: int) -> Depth | None:
        """Return the noise-free depth (h, w) of the scene, metres, 0 = none; None if there is none."""
        ...

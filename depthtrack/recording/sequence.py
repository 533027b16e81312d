"""What every recording offers, whatever its format: frames one at a time, a camera, ground truth if it has any."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np

from depthtrack.geometry.camera import Camera
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.types import Array, Depth, Image, Mask


@dataclass(frozen=True)
class Frame:
    """One RGB-D frame.

    `timestamp` in seconds; `depth` (h, w) float32 metres along the optical axis, 0 where there is no reading;
    `colour` (h, w, 3) uint8 RGB registered to the depth, or None.
    """

    index: int
    timestamp: float
    depth: Depth
    colour: Image | None
    camera: Camera


@dataclass(frozen=True)
class GroundTruth:
    """What is known about a recording beside its images; each part may be absent.

    `timestamps` (T,) of the annotated frames in seconds, increasing; `poses` (T, 27); `joints` (T, 21, 3) keypoints
    in metres, camera frame, MediaPipe order; `hand` the sizes of the recorded hand. An annotated frame may be missing
    from the images and the other way round: look a frame up by its timestamp with `at`.
    """

    timestamps: Array
    poses: Array | None = None
    joints: Array | None = None
    hand: HandShape | None = None

    def at(self, timestamp: float, tolerance: float = 1e-3) -> int | None:
        """Row of the annotation at `timestamp`, or None when none lies within `tolerance` seconds."""
        after = int(np.searchsorted(self.timestamps, timestamp))
        rows = [row for row in (after - 1, after) if 0 <= row < len(self.timestamps)]
        nearest = min(rows, key=lambda row: abs(self.timestamps[row] - timestamp), default=None)
        return nearest if nearest is not None and abs(self.timestamps[nearest] - timestamp) <= tolerance else None

    def keypoints_at(self, timestamp: float) -> Array | None:
        """The 21 keypoints (21, 3) at `timestamp`, metres: the joints as annotated, else those of the pose."""
        row = self.at(timestamp)
        if row is None:
            return None
        if self.joints is not None:
            return self.joints[row]
        if self.poses is not None and self.hand is not None:
            return HandModel(self.hand).keypoints(self.poses[row])
        return None


OnDamage = Literal["refuse", "skip"]
"""What iterating does at a frame that cannot be read: raise DamagedFrameError, or count it and go on."""


@dataclass(frozen=True)
class DamagedFrame:
    """A frame that was skipped: its index and time (seconds) in the recording, and one sentence why."""

    index: int
    timestamp: float
    reason: str


class Sequence(Protocol):
    """A recording. Frames stream: each is read when asked for, and memory does not grow with the length.

    The length counts every frame the recording lists. `sequence[i]` raises DamagedFrameError where frame i cannot be
    read; iteration raises it too, or skips the frame and notes it in `damaged`, as was chosen at opening. A frame's
    `index` is its place in the list either way.
    """

    @property
    def name(self) -> str: ...

    @property
    def camera(self) -> Camera: ...

    @property
    def timestamps(self) -> Array: ...

    @property
    def ground_truth(self) -> GroundTruth | None: ...

    @property
    def description(self) -> Mapping[str, Any]:
        """How the recording was made (sensor, motion, seed, ...), as far as it says; may be empty."""
        ...

    @property
    def damaged(self) -> list[DamagedFrame]:
        """The frames skipped so far, in order."""
        ...

    def __len__(self) -> int: ...

    def __getitem__(self, index: int) -> Frame: ...

    def __iter__(self) -> Iterator[Frame]: ...

    def frames(self, indices: Iterable[int]) -> Iterator[Frame]:
        """Iterate over some of the frames only, damage treated alike; raises InputError if none can be read."""
        ...

    def hand_mask(self, index: int) -> Mask | None:
        """True silhouette (h, w) of the hand without its forearm, where the recording knows it."""
        ...

    def exact_depth(self, index: int) -> Depth | None:
        """Noise-free depth (h, w) of the whole scene in metres, 0 = none, where the recording knows it."""
        ...

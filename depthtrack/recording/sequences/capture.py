"""The recording of a motion capture: times and a camera to draw from, without images.

| file            | content                                                           |
|-----------------|-------------------------------------------------------------------|
| capture.json    | name, rate (Hz), number of frames, camera, transform to its frame |
| hand.json       | true sizes of the hand; optional                                  |
| hand_poses.csv  | true poses, 27 values a timestamp, capture frame; optional        |

The world frame is that of the capture. The camera is virtual: it only shows where pictures of the capture are drawn
from.
"""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import compact_json, read_json
from depthtrack.geometry.camera import Camera
from depthtrack.recording.ground_truth import read_ground_truth, read_hand
from depthtrack.recording.reading import ReadingOptions
from depthtrack.recording.sequences.base import BaseSequence
from depthtrack.recording.sequences.tum_lists import MAX_FRAMES
from depthtrack.types import Array, Depth

CAPTURE_FILE = "capture.json"
_FASTEST = 1e5
"""Bound on the rate of a capture, Hz."""
_FARTHEST = 1e4
"""Bound on the distance of the camera from the origin of the capture, metres."""
_TOLERANCE = 1e-6


@dataclass(frozen=True)
class CaptureDescription:
    """Contents of `capture.json`.

    name: of the capture.
    rate: frames a second, Hz.
    frames: number of frames.
    camera: virtual camera.
    T_camera_world: (4, 4) rigid transform from the capture frame to the camera frame, metres.

    Raises:
        InputError: if a value is out of range.
    """

    name: str
    rate: float
    frames: int
    camera: Camera
    T_camera_world: Array

    def __post_init__(self) -> None:
        if not 0 < self.rate <= _FASTEST:  # false for NaN
            raise InputError(f"the rate of a capture must be above 0 and at most {_FASTEST:g} Hz, found {self.rate:g}")
        if not 1 <= self.frames <= MAX_FRAMES:
            raise InputError(f"a capture must have 1 to {MAX_FRAMES} frames, found {self.frames}")
        T = self.T_camera_world
        rotates = T.shape == (4, 4) and np.allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), rtol=0, atol=_TOLERANCE)
        if not rotates or np.linalg.det(T[:3, :3]) < 0 or not np.all(np.abs(T[:3, 3]) <= _FARTHEST):
            raise InputError("T_camera_world must be a rigid transform: 4 rows of 4 numbers, metres")

    @property
    def timestamps(self) -> Array:
        """The time (T,) of each frame, seconds; the first one is 0."""
        return np.arange(self.frames) / self.rate

    def to_json(self) -> str:
        """Return the text of `capture.json`."""
        fields = {"name": self.name, "rate": self.rate, "frames": self.frames, "camera": asdict(self.camera)}
        return compact_json({**fields, "T_camera_world": self.T_camera_world.tolist()})

    @classmethod
    def from_fields(cls, fields: dict[str, Any]) -> Self:
        """Return the description of the parsed contents of a `capture.json`.

        Raises:
            KeyError, TypeError, ValueError: if an entry is missing or malformed.
            InputError: if a value is out of range.
        """
        return cls(
            name=str(fields["name"]),
            rate=float(fields["rate"]),
            frames=int(fields["frames"]),
            camera=Camera.from_fields(fields["camera"]),
            T_camera_world=np.array(fields["T_camera_world"], dtype=np.float64),
        )


class CaptureSequence(BaseSequence):
    """A folder with `capture.json`. Its frames have neither depth nor colour."""

    format_name = f"a folder with {CAPTURE_FILE} (motion capture)"
    has_depth = False

    def _open(self, camera: Camera | None) -> None:
        """See `BaseSequence`."""
        capture = read_json(self.path / CAPTURE_FILE, "the capture", CaptureDescription.from_fields)
        self._name = capture.name
        self.camera, self.T_camera_world = camera or capture.camera, capture.T_camera_world
        self.timestamps = capture.timestamps
        self.hand = read_hand(self.path)
        self.ground_truth = read_ground_truth(self.path, self.hand)

    @classmethod
    def matches(cls, path: Path) -> bool:
        """See `BaseSequence`."""
        return (path / CAPTURE_FILE).exists()

    @classmethod
    def image_size(cls, path: Path, reading: ReadingOptions | None = None) -> tuple[int, int]:
        """Return (width, height) of the virtual camera.

        Raises:
            InputError: if `capture.json` is malformed.
        """
        camera = read_json(path / CAPTURE_FILE, "the capture", CaptureDescription.from_fields).camera
        return camera.width, camera.height

    @property
    def name(self) -> str:
        """Return the name of the capture."""
        return self._name

    def read_depth(self, index: int) -> Depth:
        """Return an empty depth image."""
        return np.zeros(self.camera.shape, dtype=np.float32)

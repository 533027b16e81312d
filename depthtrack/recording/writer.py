"""Writing of sequence folders, complete or absent; equal input gives equal bytes."""

import math
import os
import secrets
import shutil
from collections import deque
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self, TextIO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthtrack.errors import InputError
from depthtrack.files import check_replaceable, move_folder
from depthtrack.geometry.camera import Camera
from depthtrack.hand.kinematics import KEYPOINT_NAMES
from depthtrack.hand.pose import ORIENTATION, POSE_SIZE
from depthtrack.hand.shape import HandShape
from depthtrack.recording.ground_truth import (
    HAND_FILE,
    JOINTS_FILE,
    JOINTS_HEADER,
    POSES_FILE,
    POSES_HEADER,
    QUATERNION_TOLERANCE,
)
from depthtrack.recording.images import write_jpeg, write_png
from depthtrack.recording.keypoints import HEADER, KEYPOINTS_FILE, keypoint_cells
from depthtrack.recording.sequence import ImageKeypoints
from depthtrack.recording.sequences.tum import EXACT_DEPTH_SCALE
from depthtrack.strict_data import exact_json_text
from depthtrack.types import Array, Image, Mask

ColourFormat = Literal["jpg", "png"]
_Table = tuple[str, tuple[str, ...]]
"""File name and header of a table of ground truth."""


class SequenceWriter:
    """Context manager that writes a sequence folder; see `sequences.tum` for its files.

        with SequenceWriter(path, camera, hand=shape, description={"motion": "everyday"}) as writer:
            for ...:
                writer.append(timestamp, depth, colour=colour, mask=mask, pose=pose, joints=joints)

    All files go to a hidden folder beside `path`. It is renamed at the end of the block, or deleted after an exception.
    An existing recording is rejected, or with `overwrite` replaced by that renaming.
    Images are encoded by `threads` workers; at most a few frames wait in memory.

    Raises:
        InputError: if `path` cannot be written, or holds a recording that must not be replaced.
    """

    def __init__(
        self,
        path: Path | str,
        camera: Camera,
        *,
        hand: HandShape | None = None,
        description: Mapping[str, Any] | None = None,
        colour_format: ColourFormat = "jpg",
        overwrite: bool = False,
        threads: int = 2,
    ) -> None:
        self._path = Path(os.path.abspath(path))
        self._camera = camera
        self._hand = hand
        self._description = dict(description or {})
        self._colour_format = colour_format
        self._overwrite = overwrite
        self._threads = threads
        self._work = self._path.parent / f".{self._path.name}.writing-{os.getpid()}-{secrets.token_hex(4)}"
        exact_json_text(self._description)  # fail before the first frame
        self._tables: dict[str, TextIO] = {}
        self._annotation: set[_Table] | None = None
        self._last_stem: str | None = None
        self._waiting: deque[Future[None]] = deque()

    def __enter__(self) -> Self:
        self._check_target()
        try:
            self._work.mkdir(parents=True)
        except OSError as error:
            raise InputError(f"cannot write to {self._path.parent}: {error.strerror}") from error
        self._pool = ThreadPoolExecutor(self._threads, thread_name_prefix="encode")
        return self

    def append(
        self,
        timestamp: float,
        depth: NDArray[np.floating[Any]],
        *,
        colour: Image | None = None,
        mask: Mask | None = None,
        exact_depth: NDArray[np.floating[Any]] | None = None,
        pose: ArrayLike | None = None,
        joints: ArrayLike | None = None,
        keypoints: ImageKeypoints | None = None,
        copied: bool = True,
    ) -> None:
        """Add a frame.

        timestamp: seconds, kept to the microsecond, increasing.
        depth, exact_depth: (h, w) metres, 0 or not finite = none. They are rounded to the camera's depth scale and to
            0.05 mm; a value beyond 65535 units becomes none.
        colour: (h, w, 3) RGB.
        mask: (h, w) of the hand.
        pose: (27,) metres, quaternion, radians, camera frame.
        joints: (21, 3) metres, camera frame; NaN if unknown.
        keypoints: in the depth image, from a detector.
        copied: whether the images are copied; if not, they must stay as they are.

        Frames may lack ground truth, but all annotated frames have the same parts.

        Raises:
            InputError: if a shape, type or value is out of range, or the image cannot be written.
        """
        stem = self._stem(timestamp)
        images = self._checked_images(
            {
                "depth": depth,
                "rgb": colour,
                "hand_mask": mask,
                "exact_depth": exact_depth,
            }
        )
        truth = self._checked_truth(pose, joints)
        # All checks precede this line, so a frame is written whole or not at all.
        self._last_stem = stem
        for kind, image in images.items():
            self._submit(kind, stem, image.copy() if copied else image)
        for (name, header), values in truth.items():
            # repr is the shortest text that reads back as the same float64.
            cells = ["" if math.isnan(value) else repr(value) for value in values.ravel().tolist()]
            self._write_line(name, ",".join(header), ",".join([stem, *cells]))
        if keypoints is not None:
            self._write_line(KEYPOINTS_FILE, ",".join(HEADER), ",".join([stem, *keypoint_cells(keypoints)]))

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with ExitStack() as stack:
            stack.callback(shutil.rmtree, self._work, ignore_errors=True)
            # On a full disk, a table that is closed raises an error too.
            for table in self._tables.values():
                stack.callback(table.close)
            stack.callback(self._pool.shutdown, cancel_futures=True)
            if kind is None:
                self._finish()

    def _check_target(self) -> None:
        check_replaceable(self._path, "depth.txt", "a sequence folder", self._overwrite)

    def _stem(self, timestamp: float) -> str:
        """Return the timestamp's text in all files, which also names the frame's images."""
        if not np.isfinite(timestamp):
            raise InputError(f"a frame's timestamp must be finite, found {timestamp}")
        stem = f"{timestamp:.6f}"
        if self._last_stem is not None and float(stem) <= float(self._last_stem):
            raise InputError(f"timestamps must increase by a microsecond or more, found {stem} after {self._last_stem}")
        return stem

    def _checked_images(self, images: dict[str, NDArray[Any] | None]) -> dict[str, NDArray[Any]]:
        given = {kind: image for kind, image in images.items() if image is not None}
        for kind, image in given.items():
            expected = (*self._camera.shape, 3) if kind == "rgb" else self._camera.shape
            if image.shape != expected:
                raise InputError(f"a frame's {kind} must have the camera's shape {expected}, found {image.shape}")
            if kind == "rgb" and image.dtype != np.uint8:
                raise InputError(f"a frame's colour must be 8-bit RGB, found {image.dtype}")
        return given

    def _checked_truth(self, pose: ArrayLike | None, joints: ArrayLike | None) -> dict[_Table, Array]:
        rows: dict[_Table, Array] = {}
        for table, shape, values in (
            ((POSES_FILE, POSES_HEADER), (POSE_SIZE,), pose),
            ((JOINTS_FILE, JOINTS_HEADER), (len(KEYPOINT_NAMES), 3), joints),
        ):
            if values is None:
                continue
            rows[table] = np.asarray(values, dtype=np.float64)
            # Joints may be unknown, which the table states as blank cells.
            bad = np.isinf(rows[table]) if values is joints else ~np.isfinite(rows[table])
            if rows[table].shape != shape or bad.any():
                raise InputError(f"a row of {table[0]} must be {shape} finite numbers, found shape {rows[table].shape}")
        if pose is not None and abs(np.linalg.norm(np.asarray(pose)[ORIENTATION]) - 1) > QUATERNION_TOLERANCE:
            raise InputError("a pose's quaternion must have length 1: normalise it first")
        if rows and self._annotation is not None and rows.keys() != self._annotation:
            raise InputError("all annotated frames of a recording must have pose, joints or both alike")
        self._annotation = set(rows) or self._annotation
        return rows

    def _submit(self, kind: str, stem: str, image: NDArray[Any]) -> None:
        """Submit an image to the workers and list it; wait for them if the queue is long."""
        suffix = self._colour_format if kind == "rgb" else "png"
        path = self._work / kind / f"{stem}.{suffix}"
        path.parent.mkdir(exist_ok=True)
        self._waiting.append(self._pool.submit(self._encode, kind, path, image))
        while len(self._waiting) > 8 * self._threads:
            self._waiting.popleft().result()
        if kind in ("depth", "rgb"):
            self._write_line(f"{kind}.txt", "# timestamp[s] filename", f"{stem} {kind}/{path.name}")
        if kind == "exact_depth":
            self._description["exact_depth_scale"] = EXACT_DEPTH_SCALE

    def _encode(self, kind: str, path: Path, image: NDArray[Any]) -> None:
        if kind == "rgb":
            (write_jpeg if path.suffix == ".jpg" else write_png)(path, image)
        elif kind == "hand_mask":
            write_png(path, (image != 0) * np.uint8(255))
        else:
            write_png(path, _stored(image, self._camera.depth_scale if kind == "depth" else EXACT_DEPTH_SCALE))

    def _write_line(self, name: str, header: str, line: str) -> None:
        if name not in self._tables:
            self._tables[name] = (self._work / name).open("w", encoding="utf-8", newline="\n")
            self._tables[name].write(header + "\n")
        self._tables[name].write(line + "\n")

    def _finish(self) -> None:
        """Write all files, then rename the folder, which makes the recording visible."""
        if self._last_stem is None:
            raise InputError(f"a recording needs at least one frame, found none for {self._path}")
        while self._waiting:
            self._waiting.popleft().result()
        for table in self._tables.values():
            table.close()
        self._write_text("camera.json", self._camera.to_json())
        self._write_text("sequence.json", exact_json_text(self._description, indent=2) + "\n")
        if self._hand is not None:
            self._write_text(HAND_FILE, self._hand.to_json())
        self._check_target()
        move_folder(self._work, self._path)

    def _write_text(self, name: str, text: str) -> None:
        (self._work / name).write_text(text, encoding="utf-8", newline="\n")


def _stored(depth: NDArray[Any], scale: float) -> NDArray[np.uint16]:
    """Return depth (h, w) in units of `scale` metres; 0 if it is not finite or exceeds 16 bits."""
    units = depth / np.float64(scale)
    np.rint(units, out=units)
    is_stored = (units >= 0) & (units <= np.iinfo(np.uint16).max)
    if not is_stored.all():
        units[~is_stored] = 0
    return units.astype(np.uint16)

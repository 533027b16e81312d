"""Base of the readers: indexing, iteration and the record of damaged frames."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.distortion import Undistortion
from depthtrack.hand.shape import HandShape
from depthtrack.recording.reading import ReadingOptions
from depthtrack.recording.sequence import DamagedFrame, Frame, GroundTruth, OnDamage
from depthtrack.types import Array, Depth, Image, Mask

Value = TypeVar("Value", bound=np.generic)


class BaseSequence(ABC):
    """A recording of one format; see `Sequence` for the contract.

    A format sets `format_name` and overrides `matches`, `image_size`, `read_depth` and `_open`, which sets `camera` and
    `timestamps` (N,), seconds, increasing. It overrides the rest if its recordings hold more. It appends to `notes`
    what the user must know: colour that is not used, a file that is cut short.
    """

    format_name: ClassVar[str]
    """The format's description for errors: "a folder with depth.txt (TUM RGB-D layout)"."""
    is_generic: ClassVar[bool] = False
    """Whether `matches` accepts what other formats may accept too; such formats are tried last."""

    camera: Camera
    timestamps: Array
    T_camera_world: Array = np.eye(4)
    has_depth: bool = True
    has_colour: bool = False
    hand: HandShape | None = None
    ground_truth: GroundTruth | None = None

    def __init__(
        self,
        path: Path,
        camera: Camera | None = None,
        on_damage: OnDamage = "refuse",
        reading: ReadingOptions | None = None,
    ) -> None:
        """Open a recording; `camera` replaces the recording's own.

        Raises:
            InputError: if the recording is unusable for a reason that shows without decoding images.
        """
        self.path = path
        self.description: Mapping[str, Any] = {}
        self.on_damage = on_damage
        self.reading = reading or ReadingOptions()
        self.notes: list[str] = []
        self._undistortion: Undistortion | None = None
        self._damaged: dict[int, DamagedFrame] = {}
        self._damaged_colour: dict[int, DamagedFrame] = {}
        self._open(camera)
        self.has_colour = self.has_colour and not self.reading.depth_only
        if self.reading.depth_scale is not None:
            self.camera = replace(self.camera, depth_scale=self.reading.depth_scale)

    @abstractmethod
    def _open(self, camera: Camera | None) -> None:
        """Read what is known without decoding images, and set `camera` and `timestamps`.

        camera: given by the user in place of the recording's own; None if it is not.

        Raises:
            InputError: if the recording is unusable.
        """

    @classmethod
    @abstractmethod
    def matches(cls, path: Path) -> bool:
        """Return whether the existing `path` holds a recording of this format."""

    @classmethod
    @abstractmethod
    def image_size(cls, path: Path, reading: ReadingOptions | None = None) -> tuple[int, int]:
        """Return (width, height) of the depth images, without a camera.

        Raises:
            InputError: if no depth image can be read.
        """

    @abstractmethod
    def read_depth(self, index: int) -> Depth:
        """Return the depth image (h, w) of a frame, metres, 0 = no measurement.

        Raises:
            DamagedFrameError: if it cannot be read.
        """

    def read_colour(self, index: int) -> Image | None:
        """Return the RGB image (h, w, 3) registered to the depth, or None if there is none.

        Raises:
            DamagedFrameError: if it cannot be read.
        """
        return None

    def hand_mask(self, index: int) -> Mask | None:
        """See `Sequence`."""
        return None

    def exact_depth(self, index: int) -> Depth | None:
        """See `Sequence`."""
        return None

    @property
    def name(self) -> str:
        """Return the name of the file or folder."""
        return self.path.resolve().name

    @property
    def damaged(self) -> list[DamagedFrame]:
        """See `Sequence`."""
        return [self._damaged[index] for index in sorted(self._damaged)]

    @property
    def damaged_colour(self) -> list[DamagedFrame]:
        """See `Sequence`."""
        return [self._damaged_colour[index] for index in sorted(self._damaged_colour)]

    def __len__(self) -> int:
        return len(self.timestamps)

    def __getitem__(self, index: int) -> Frame:
        index = range(len(self))[index]
        return Frame(
            index=index,
            timestamp=float(self.timestamps[index]),
            depth=self._corrected_depth(self.read_depth(index)),
            colour=self._corrected_colour(self._readable_colour(index)),
            camera=self.camera,
        )

    def _readable_colour(self, index: int) -> Image | None:
        """Return the colour of a frame; None, and an entry in `damaged_colour`, if damaged."""
        if self.reading.depth_only:
            return None
        try:
            return self.read_colour(index)
        except DamagedFrameError as error:
            self._damaged_colour[index] = DamagedFrame(index, float(self.timestamps[index]), str(error))
            return None

    def _corrected_depth(self, depth: Depth) -> Depth:
        """Return depth (h, w) as the options of reading say."""
        read = self._mirrored(self._valid(depth))
        return read if self._undistortion is None else self._undistortion.depth(read)

    def _corrected_colour(self, colour: Image | None) -> Image | None:
        """Return colour (h, w, 3) as the options of reading say."""
        read = None if colour is None else self._mirrored(colour)
        return read if self._undistortion is None or read is None else self._undistortion.colour(read)

    def _valid(self, depth: Depth) -> Depth:
        """Return depth (h, w) with 0 in place of the stored values that mean no reading."""
        if not self.reading.invalid:
            return depth
        stored = np.rint(depth / np.float32(self.camera.depth_scale))
        return np.where(np.isin(stored, self.reading.invalid), np.float32(0), depth)

    def _mirrored(self, image: NDArray[Value]) -> NDArray[Value]:
        """Return an image (h, w, ...), mirrored if the options say so."""
        return np.ascontiguousarray(image[:, ::-1]) if self.reading.mirror else image

    def __iter__(self) -> Iterator[Frame]:
        return self.frames(range(len(self)))

    def frames(self, indices: Iterable[int]) -> Iterator[Frame]:
        """See `Sequence`."""
        readable, last_error = 0, None
        for index in indices:
            try:
                frame = self[index]
            except DamagedFrameError as error:
                if self.on_damage == "refuse":
                    raise DamagedFrameError(
                        f"frame {index}: {error} (--on-damage skip leaves such frames out)"
                    ) from error
                self._damaged[index] = DamagedFrame(index, float(self.timestamps[index]), str(error))
                last_error = error
                continue
            readable += 1
            yield frame
        if last_error is not None and not readable:
            raise InputError(f"{self.path}: no frame can be read; the last error: {last_error}") from last_error

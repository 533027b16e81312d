"""The sequence folder: a TUM RGB-D folder with, where we or others wrote them, camera and ground truth.

depth.txt, depth/     timestamps and 16-bit PNGs             rgb.txt, rgb/   the same in colour, optional
camera.json           intrinsics and depth scale             sequence.json   how it was made
hand_poses.csv        27 pose values a timestamp             joints.csv      21 keypoints a timestamp
hand.json             sizes of the hand
hand_mask/, skin_mask/, exact_depth/                         PNGs named as in depth/

A synthetic hand_mask/ shows the hand up to the plane of its wrist, whether the sensor has a reading there or not.
"""

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.files import check_size, read_text
from depthtrack.geometry.camera import Camera
from depthtrack.recording.ground_truth import read_ground_truth
from depthtrack.recording.images import read_colour, read_depth, read_mask, read_size
from depthtrack.recording.sequence import DamagedFrame, Frame, GroundTruth, OnDamage
from depthtrack.recording.sequences.tum_lists import associate, is_inside, read_list
from depthtrack.types import Array, Depth, Image, Mask

EXACT_DEPTH_SCALE = 0.00005
"""Metres per unit of `exact_depth/`: steps of 0.05 mm up to 3.27 m. `sequence.json` may state another."""

_MAX_JSON_BYTES = 1 << 20


class FolderSequence:
    """Reads a sequence folder; see `Sequence` for the contract.

    `camera` replaces `camera.json`, and is needed for a plain TUM folder, which has none. Whatever can be checked
    without decoding images is checked here: raises InputError.
    """

    def __init__(self, folder: Path, camera: Camera | None = None, on_damage: OnDamage = "refuse") -> None:
        self.folder = folder
        self.camera = camera or _read_camera(folder)
        self.description: Mapping[str, Any] = _read_description(folder)
        self._depth = read_list(folder, "depth.txt")
        self._colour = read_list(folder, "rgb.txt") if (folder / "rgb.txt").exists() else []
        self._partner = associate([file.timestamp for file in self._depth], [file.timestamp for file in self._colour])
        self.timestamps: Array = np.array([file.timestamp for file in self._depth])
        self.ground_truth: GroundTruth | None = read_ground_truth(folder)
        self._exact_scale = _exact_depth_scale(self.description, folder)
        self._on_damage = on_damage
        self._damaged: dict[int, DamagedFrame] = {}

    @property
    def name(self) -> str:
        return self.folder.resolve().name

    @property
    def damaged(self) -> list[DamagedFrame]:
        return [self._damaged[index] for index in sorted(self._damaged)]

    def __len__(self) -> int:
        return len(self._depth)

    def __getitem__(self, index: int) -> Frame:
        index = range(len(self))[index]
        stored = read_depth(self.folder / self._depth[index].name, self.camera.shape)
        return Frame(
            index=index,
            timestamp=self._depth[index].timestamp,
            depth=_metres(stored, self.camera.depth_scale),
            colour=self._read_colour(index),
            camera=self.camera,
        )

    def __iter__(self) -> Iterator[Frame]:
        return self.frames(range(len(self)))

    def frames(self, indices: Iterable[int]) -> Iterator[Frame]:
        """See `Sequence`."""
        readable, last_error = 0, None
        for index in indices:
            try:
                frame = self[index]
            except DamagedFrameError as error:
                if self._on_damage == "refuse":
                    raise DamagedFrameError(
                        f"frame {index}: {error} (--on-damage skip leaves such frames out)"
                    ) from error
                self._damaged[index] = DamagedFrame(index, self._depth[index].timestamp, str(error))
                last_error = error
                continue
            readable += 1
            yield frame
        if last_error is not None and not readable:
            raise InputError(f"{self.folder}: not one frame can be read; the last: {last_error}") from last_error

    def hand_mask(self, index: int) -> Mask | None:
        """See `Sequence`. Raises DamagedFrameError where the mask is there and cannot be read."""
        path = self._beside(index, "hand_mask")
        return None if path is None else read_mask(path, self.camera.shape)

    def skin_mask(self, index: int) -> Mask | None:
        """Skin labels (h, w), right or wrong, that a synthetic recording brings in place of a colour segmentation's.

        Raises DamagedFrameError where the mask is there and cannot be read.
        """
        path = self._beside(index, "skin_mask")
        return None if path is None else read_mask(path, self.camera.shape)

    def exact_depth(self, index: int) -> Depth | None:
        """See `Sequence`. Raises DamagedFrameError where the image is there and cannot be read."""
        path = self._beside(index, "exact_depth")
        return None if path is None else _metres(read_depth(path, self.camera.shape), self._exact_scale)

    def _read_colour(self, index: int) -> Image | None:
        if index not in self._partner:
            return None
        return read_colour(self.folder / self._colour[self._partner[index]].name, self.camera.shape)

    def _beside(self, index: int, kind: str) -> Path | None:
        """The image of another kind that belongs to a depth image, by that image's name."""
        name = f"{kind}/{PurePosixPath(self._depth[index].name).stem}.png"
        path = self.folder / name
        if not os.path.lexists(path):
            return None
        if not is_inside(self.folder, name):
            raise DamagedFrameError(f"{path} must lie within the folder of the recording")
        return path


def image_size(folder: Path) -> tuple[int, int]:
    """(width, height) of the first readable depth image, for making a camera. Raises InputError."""
    for file in read_list(folder, "depth.txt"):
        try:
            return read_size(folder / file.name)
        except DamagedFrameError:
            continue
    raise InputError(f"{folder}: none of the depth images can be read")


def _metres(stored: NDArray[np.uint16], scale: float) -> Depth:
    return stored.astype(np.float32) * np.float32(scale)


def _read_camera(folder: Path) -> Camera:
    path = folder / "camera.json"
    if not path.exists():
        raise InputError(
            f"{folder} has no camera.json, so the camera is unknown:"
            " give it with --camera FILE.json, --camera-preset NAME, or --fx and --depth-scale"
        )
    check_size(path, _MAX_JSON_BYTES)
    return Camera.from_json(path)


def _read_description(folder: Path) -> Mapping[str, Any]:
    path = folder / "sequence.json"
    if not path.exists():
        return {}
    try:
        fields = json.loads(read_text(path, _MAX_JSON_BYTES), parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path} must be a JSON object that says how the recording was made: {error}") from error
    if not isinstance(fields, dict):
        raise InputError(f"{path} must be a JSON object that says how the recording was made, found {type(fields)}")
    return fields


def _refuse_constant(name: str) -> float:
    raise ValueError(f"JSON has no {name}")


def _exact_depth_scale(description: Mapping[str, Any], folder: Path) -> float:
    scale = description.get("exact_depth_scale", EXACT_DEPTH_SCALE)
    if not isinstance(scale, float) or not 1e-6 <= scale <= 0.1:
        raise InputError(f"{folder / 'sequence.json'}: exact_depth_scale must be metres per unit, found {scale!r}")
    return scale

"""The sequence folder: a TUM RGB-D folder with optional camera and ground truth.

| file                 | content                                     |
|----------------------|---------------------------------------------|
| depth.txt, depth/    | timestamps and 16-bit PNGs                  |
| rgb.txt, rgb/        | timestamps and PNGs or JPEGs; optional      |
| camera.json          | intrinsics and depth scale; optional        |
| sequence.json        | sensor, motion, seed, ...; optional         |
| hand.json            | sizes of the hand; optional                 |
| hand_poses.csv       | 27 pose values a timestamp; optional        |
| joints.csv           | 21 keypoints a timestamp; optional          |
| keypoints.csv        | 2D keypoints of a detector; optional        |
| hand_mask/           | PNGs with the names of depth/; optional     |
| exact_depth/         | 16-bit PNGs, likewise; optional             |

A synthetic hand_mask/ shows the hand up to the plane of its wrist, also where the sensor has no reading.
"""

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import Any

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.files import read_json
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.camera_files import read_camera
from depthtrack.geometry.distortion import Distortion, Undistortion
from depthtrack.recording.colour_association import ColourAssociation, associate_colour
from depthtrack.recording.ground_truth import read_ground_truth, read_hand
from depthtrack.recording.images import read_colour, read_depth, read_mask, read_size
from depthtrack.recording.reading import ReadingOptions
from depthtrack.recording.sequence import GroundTruth
from depthtrack.recording.sequences.base import BaseSequence
from depthtrack.recording.sequences.inside import is_inside
from depthtrack.recording.sequences.tum_folder import ImageFiles, find_lists, holds_images
from depthtrack.recording.sequences.tum_lists import ImageList
from depthtrack.recording.time_units import Clock, clock_of
from depthtrack.types import Depth, Image, Mask

CAMERA_FILES = ("camera.json", "camera_info.yaml", "camera.yaml", "camera_intrinsic.json", "intrinsic.json")
EXACT_DEPTH_SCALE = 0.00005
"""Metres per unit of `exact_depth/`: steps of 0.05 mm up to 3.27 m. `sequence.json` may state another."""


class TumSequence(BaseSequence):
    """A sequence folder. A plain TUM folder has no `camera.json`, so `camera` must be given."""

    format_name = "a folder with depth.txt (TUM RGB-D layout)"
    is_generic = True

    def _open(self, camera: Camera | None) -> None:
        """See `BaseSequence`."""
        self.camera = camera or self._own_camera()
        self._undistort()
        self.description = _read_description(self.path)
        lists = find_lists(self.path)
        self._files = ImageFiles(self.path)
        self._depth, clock = self._timed(lists.depth)
        self.timestamps = clock.seconds(self._depth.times)
        self._colour, self._association = self._associated(lists.colour)
        self.has_colour = bool(self._association.partner)
        self.notes += [note for note in (lists.note, clock.note, self._association.note) if note is not None]
        self.hand = read_hand(self.path)
        self.ground_truth = self._annotations(clock)
        self._exact_camera = replace(self.camera, depth_scale=_exact_depth_scale(self.description, self.path))

    def _own_camera(self) -> Camera:
        """Return the camera of the folder, and store its distortion. Raises InputError."""
        path = next((self.path / name for name in CAMERA_FILES if (self.path / name).exists()), None)
        if path is None:
            raise InputError(
                f"{self.path} has no camera.json, so the camera is unknown:"
                " give it with --camera FILE, --camera-preset NAME, or --fx and --depth-scale"
            )
        file = read_camera(path)
        self.notes += file.notes
        if file.distortion and not self.reading.distortion:
            self.reading = replace(self.reading, distortion=file.distortion)
        return file.camera

    def _undistort(self) -> None:
        """Prepare the removal of lens distortion. Raises InputError."""
        if not any(self.reading.distortion):
            return
        self._undistortion = Undistortion(self.camera, Distortion(self.reading.distortion))
        self.notes.append(
            f"lens distortion is removed, which moves points by up to {self._undistortion.pixels:.1f} pixels"
        )

    def _associated(self, colour: ImageList | None) -> tuple[ImageList | None, ColourAssociation]:
        """Return the colour and its association; none if it has another size. Raises InputError."""
        if colour is None or self.reading.depth_only:
            return None, ColourAssociation()
        kept, clock = self._timed(colour)
        size = next(_sizes(self._files.path(file.name) for file in kept.files), None)
        if size is not None and size != (self.camera.width, self.camera.height):
            note = (
                f"colour of {size[0]}x{size[1]} pixels is not registered to the depth of"
                f" {self.camera.width}x{self.camera.height}: depth alone"
            )
            return None, ColourAssociation(note=note)
        return kept, associate_colour(self.timestamps, clock.seconds(kept.times))

    def _timed(self, images: ImageList) -> tuple[ImageList, Clock]:
        """Return a list with increasing times, and their clock. Raises InputError."""
        unit = self.reading.time_unit
        if unit == "index":
            return images, Clock("index")
        if self.on_damage == "refuse":
            images.check_increasing()
        kept = images.increasing()
        if kept.left_out:
            self.notes.append(
                f"{kept.left_out} of {len(images.files)} lines of {images.path.name} are left out:"
                " their times do not increase"
            )
        return kept, clock_of(kept.times, kept.whole, unit)

    def _annotations(self, clock: Clock) -> GroundTruth | None:
        """Return the ground truth in seconds; None for mirrored images, which it does not describe."""
        truth = read_ground_truth(self.path, self.hand)
        if truth is None or self.reading.mirror:
            return None
        return replace(truth, timestamps=clock.times_between(truth.timestamps))

    @classmethod
    def matches(cls, path: Path) -> bool:
        """See `BaseSequence`."""
        return holds_images(path)

    @classmethod
    def image_size(cls, path: Path, reading: ReadingOptions | None = None) -> tuple[int, int]:
        """See `BaseSequence`."""
        files = ImageFiles(path)
        size = next(_sizes(files.path(file.name) for file in find_lists(path).depth.files), None)
        if size is None:
            raise InputError(f"{path}: none of the depth images can be read")
        return size

    def read_depth(self, index: int) -> Depth:
        """See `BaseSequence`."""
        stored = read_depth(self._files.path(self._depth.files[index].name), self.camera.shape)
        return self.camera.metres(stored)

    def read_colour(self, index: int) -> Image | None:
        """See `BaseSequence`."""
        if self._colour is None or index not in self._association.partner:
            return None
        file = self._colour.files[self._association.partner[index]]
        return read_colour(self._files.path(file.name), self.camera.shape)

    def hand_mask(self, index: int) -> Mask | None:
        """See `Sequence`.

        Raises:
            DamagedFrameError: if the mask exists and cannot be read.
        """
        path = self._beside(index, "hand_mask")
        return None if path is None else self._mirrored(read_mask(path, self.camera.shape))

    def exact_depth(self, index: int) -> Depth | None:
        """See `Sequence`.

        Raises:
            DamagedFrameError: if the image exists and cannot be read.
        """
        path = self._beside(index, "exact_depth")
        if path is None:
            return None
        return self._mirrored(self._exact_camera.metres(read_depth(path, self.camera.shape)))

    def _beside(self, index: int, kind: str) -> Path | None:
        """Return the image of another kind with a depth image's name; None if there is none."""
        name = f"{kind}/{PurePosixPath(self._depth.files[index].name).stem}.png"
        path = self.path / name
        if not os.path.lexists(path):
            return None
        if not is_inside(self.path, name):
            raise DamagedFrameError(f"{path} must lie within the folder of the recording")
        return path


def _sizes(paths: Iterable[Path]) -> Iterator[tuple[int, int]]:
    """Yield (width, height) of the readable images."""
    for path in paths:
        try:
            yield read_size(path)
        except DamagedFrameError:
            continue


def _read_description(folder: Path) -> Mapping[str, Any]:
    path = folder / "sequence.json"
    return read_json(path, "the description of the recording", _check_description) if path.exists() else {}


def _check_description(fields: Any) -> Mapping[str, Any]:
    if not isinstance(fields, dict):
        raise InputError(f"expected a JSON object that describes the recording, found {type(fields).__name__}")
    return fields


def _exact_depth_scale(description: Mapping[str, Any], folder: Path) -> float:
    scale = description.get("exact_depth_scale", EXACT_DEPTH_SCALE)
    if not isinstance(scale, float) or not 1e-6 <= scale <= 0.1:
        raise InputError(f"{folder / 'sequence.json'}: exact_depth_scale must be metres per unit, found {scale!r}")
    return scale

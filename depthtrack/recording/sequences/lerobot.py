"""Depth of a LeRobot data set: a video of quantised depth, or a folder of TIFF images.

| file                                            | content                                                  |
|-------------------------------------------------|----------------------------------------------------------|
| meta/info.json                                  | `features`: kind, size, `info` with the quantisation     |
| videos/KEY/chunk-000/file-000.mp4               | 12-bit codes of depth (gray12le), several episodes       |
| videos/chunk-000/KEY/episode_000000.mp4         | the same, in data sets of version 2                      |
| images/KEY/episode-000000/frame-000000.tiff     | whole mm of 16 bits, or floats in m                      |

A code q of 0 to 4095 stands for s = q / 4095. With `video.use_log` the depth z has
log(z + shift) = (1 - s) log(min + shift) + s log(max + shift), otherwise z = (1 - s) min + s max. Code 0 is no reading.
Source: R. Cadene et al., LeRobot 0.6, datasets/depth_utils.py and its page on video encoding.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.files import read_json
from depthtrack.geometry.camera import Camera
from depthtrack.recording.depth_tiff import read_tiff_depth, read_tiff_size
from depthtrack.recording.depth_video import DepthVideo
from depthtrack.recording.reading import ReadingOptions
from depthtrack.recording.sequences.base import BaseSequence
from depthtrack.recording.sequences.numbered_files import has_file, numbered_files
from depthtrack.types import Array32, Depth

_INFO = Path("meta") / "info.json"
_IMAGE = re.compile(r"frame[-_](\d+)\.tiff?")
_LEVELS = 5
"""Folders between a video and the folder of its data set, at most."""
_CODES = 1 << 12
_QUANTISATION = ("depth_min", "depth_max", "shift")


@dataclass(frozen=True)
class _Feature:
    """Name and description of a depth feature, and the folder of its data set."""

    root: Path
    key: str
    info: Mapping[str, Any]
    rate: float


class LeRobotSequence(BaseSequence):
    """One depth video, or one folder of depth images, of a data set."""

    format_name = "a depth video or depth images of a folder with meta/info.json (LeRobot)"

    def _open(self, camera: Camera | None) -> None:
        """See `BaseSequence`."""
        source = _Source.of(self.path)
        if camera is None:
            raise InputError(
                f"{source.path}: LeRobot stores no camera: give it with --camera FILE.json, --camera-preset NAME, or"
                " --fx and --depth-scale"
            )
        self.camera = camera
        self.description = {"data set": "LeRobot", "feature": source.feature.key}
        self._source = source
        self._video = DepthVideo(source.path) if source.is_video else None
        if self._video is not None:
            self._metres = _decoding(source, self._video)
            self.timestamps = self._video.times
            if self._video.truncated:
                self.notes.append(
                    f"{source.path} is cut short: the {len(self.timestamps)} frames before the cut are read"
                )
        else:
            files = numbered_files(source.path, _IMAGE)
            self._files = list(files.values())
            self.timestamps = np.array(list(files), dtype=np.float64) / source.feature.rate

    @classmethod
    def matches(cls, path: Path) -> bool:
        """See `BaseSequence`."""
        return _root(path) is not None and (
            (path / _INFO).is_file() or path.suffix.lower() == ".mp4" or has_file(path, _IMAGE)
        )

    @classmethod
    def image_size(cls, path: Path, reading: ReadingOptions | None = None) -> tuple[int, int]:
        """Return (width, height) of the depth.

        Raises:
            InputError: if it cannot be read.
        """
        source = _Source.of(path)
        if source.is_video:
            video = DepthVideo(source.path)
            return video.width, video.height
        for name in numbered_files(source.path, _IMAGE).values():
            try:
                return read_tiff_size(source.path / name)
            except DamagedFrameError:
                continue
        raise InputError(f"{source.path}: none of the depth images can be read")

    def read_depth(self, index: int) -> Depth:
        """See `BaseSequence`."""
        if self._video is None:
            return read_tiff_depth(self._source.path / self._files[index], self.camera.shape)
        if (self._video.height, self._video.width) != self.camera.shape:
            raise DamagedFrameError(
                f"{self._source.path} must have the camera's {self.camera.width}x{self.camera.height} pixels, found"
                f" {self._video.width}x{self._video.height}"
            )
        codes = self._video.read(index)
        return self._metres[np.minimum(codes, len(self._metres) - 1)]


@dataclass(frozen=True)
class _Source:
    """The video or the folder of images that is read."""

    path: Path
    is_video: bool
    feature: _Feature

    @classmethod
    def of(cls, path: Path) -> Self:
        """Return the only depth of a path: a data set, a video, or a folder of images.

        Raises:
            InputError: if there is none, or several, or the depth was stored as colour.
        """
        root = _root(path)
        assert root is not None  # `matches` found it
        features = read_json(root / _INFO, "the description of the data set", lambda fields: _features(root, fields))
        if (path / _INFO).is_file():
            found = [source for feature in features for source in cls._all(feature)]
            if len(found) != 1:
                names = ", ".join(str(source.path.relative_to(root)) for source in found[:3])
                raise InputError(
                    f"{root} holds {len(found)} depth videos and folders of images, as {names}: give one of them"
                )
            return found[0]
        parts = path.resolve().relative_to(root.resolve()).parts
        feature = next((feature for feature in features if feature.key in parts), None)
        if feature is None:
            raise InputError(
                f"{path} is no depth by {root / _INFO}: give one of {', '.join(feature.key for feature in features)}"
            )
        return cls(path, path.is_file(), feature)

    @classmethod
    def _all(cls, feature: _Feature) -> list[Self]:
        """Return the videos of a feature, or its folders of images."""
        videos = [
            path
            for path in sorted((feature.root / "videos").glob("*/*/*.mp4"))
            if feature.key in path.relative_to(feature.root).parts
        ]
        folders = sorted(path for path in (feature.root / "images" / feature.key).glob("*") if has_file(path, _IMAGE))
        return [cls(path, True, feature) for path in videos] or [cls(path, False, feature) for path in folders]


def _root(path: Path) -> Path | None:
    """Return the folder of the data set that a path belongs to."""
    whole = path.resolve()
    return next((each for each in (whole, *list(whole.parents)[:_LEVELS]) if (each / _INFO).is_file()), None)


def _features(root: Path, fields: Any) -> list[_Feature]:
    """Return the depth features that `info.json` describes.

    Raises:
        InputError: if there are none.
    """
    rate = float(fields["fps"])
    if not 0 < rate <= 1000:
        raise InputError(f"fps must be above 0 and at most 1000, found {rate:g}")
    found, colours = list[_Feature](), list[_Feature]()
    for key, feature in fields["features"].items():
        if not isinstance(feature, dict) or feature.get("dtype") not in ("video", "image"):
            continue
        info = feature.get("info") or feature.get("video_info") or {}
        is_depth = info.get("is_depth_map", info.get("video.is_depth_map")) is True
        (found if is_depth else colours).append(_Feature(root, str(key), info, rate))
    if not found:
        named = [feature.key for feature in colours if "depth" in feature.key]
        reason = (
            f"{named[0]} is stored as colour, in which depth has lost its meaning" if named else "found colour alone"
        )
        raise InputError(f"a feature must be marked is_depth_map to be read as depth, but {reason}: record it again")
    return found


def _decoding(source: _Source, video: DepthVideo) -> Array32:
    """Return the depth, metres, of each sample of the video.

    Raises:
        InputError: if the quantisation of 12-bit codes is missing or malformed.
    """
    info = source.feature.info
    stated = {name: info.get(f"video.{name}") for name in (*_QUANTISATION, "use_log")}
    if video.bits == 16 and stated["depth_min"] is None:
        return np.arange(1 << 16, dtype=np.float32) * np.float32(0.001)
    low, high, shift = (_number(stated[name]) for name in _QUANTISATION)
    use_log = stated["use_log"]
    if not isinstance(use_log, bool) or not 0 <= low < high or not low + shift > 0:  # false for NaN
        raise InputError(
            f"{source.feature.root / _INFO} must state video.depth_min, depth_max, shift and use_log of"
            f" {source.feature.key}, found {str(stated)[:120]}"
        )
    share = np.arange(_CODES) / (_CODES - 1)
    if use_log:
        metres = np.exp(np.log(low + shift) * (1 - share) + np.log(high + shift) * share) - shift
    else:
        metres = low * (1 - share) + high * share
    metres[0] = 0
    return metres.astype(np.float32)


def _number(value: Any) -> float:
    """Return a number below 10 km; NaN for anything else."""
    valid = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e4
    return float(value) if valid else float("nan")

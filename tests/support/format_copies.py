"""Copies of a recording in every format that is read, by the writers of the tests."""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthtrack.geometry.camera import Camera
from depthtrack.recording import Sequence, open_sequence
from depthtrack.recording.convert import convert
from tests.support import data_sets, lerobot
from tests.support.bags import Bag, compose, depth_rvl
from tests.support.matroska import calibration, write_azure_kinect
from tests.support.oni import write_oni
from tests.support.record3d import copy_as_r3d

UNIT = 0.001
_AZURE_HEIGHT = 576
"""Rows of a depth mode of the Azure Kinect that has 640 columns."""


@dataclass(frozen=True)
class Source:
    """A recording of 640x480 pixels, and its images."""

    folder: Path
    recording: Sequence
    depths: list[NDArray[np.float32]]
    colours: list[NDArray[np.uint8]]

    @classmethod
    def of(cls, folder: Path) -> "Source":
        recording = open_sequence(folder)
        frames = list(recording)
        colours = [frame.colour for frame in frames if frame.colour is not None]
        return cls(folder, recording, [frame.depth for frame in frames], colours)

    @property
    def stored(self) -> list[NDArray[np.uint16]]:
        return [np.rint(depth / UNIT).astype(np.uint16) for depth in self.depths]

    @property
    def camera(self) -> Camera:
        return self.recording.camera

    @property
    def times(self) -> list[float]:
        return [float(time) for time in self.recording.timestamps]


@dataclass(frozen=True)
class FormatCopy:
    """A format: who writes its file here, and what the commands need beside it.

    write: from a source and a folder to the path that the commands take.
    """

    name: str
    writer: str
    write: Callable[[Source, Path], Path]
    needs_camera: bool = False


def _folder(source: Source, out: Path) -> Path:
    return source.folder


def _bag(suffix: str, source: Source, out: Path) -> Path:
    bag = compose(source.depths.__getitem__, source.colours.__getitem__, source.camera, source.times)
    return bag.write(out / f"copy{suffix}")


def _rvl(source: Source, out: Path) -> Path:
    bag = Bag()
    for stored, time in zip(source.stored, source.times, strict=True):
        bag.compressed("/depth/image_raw/compressedDepth", time, depth_rvl(stored), "16UC1; compressedDepth rvl")
        bag.info("/depth/camera_info", source.camera, time=time)
    return bag.write(out / "copy.mcap")


def _converted(source: Source, out: Path) -> Path:
    convert(source.recording, out / "copy.mcap")
    return out / "copy.mcap"


def _realsense(source: Source, out: Path) -> Path:
    from tests.support.realsense import record

    record(out / "copy.db3", source.camera, source.camera, np.eye(4), source.stored, source.colours, UNIT)
    return out / "copy.db3"


def _azure(source: Source, out: Path) -> Path:
    above = (_AZURE_HEIGHT - source.camera.height) // 2
    padded = [np.pad(stored, ((above, above), (0, 0))) for stored in source.stored]
    camera = source.camera
    depth = Camera(camera.width, _AZURE_HEIGHT, camera.fx, camera.fy, camera.cx, camera.cy + above)
    colour = Camera(1280, 720, 605.0, 605.0, 638.0, 366.0)
    return write_azure_kinect(out / "copy.mkv", padded, [], calibration(depth, colour, np.eye(4)), source.times)


def _ffv1(source: Source, out: Path) -> Path:
    return lerobot.write_video(out / "copy.mkv", source.stored, "ffv1", "gray16le", {}, container_format="matroska")


def _record3d(source: Source, out: Path) -> Path:
    return copy_as_r3d(source.folder, out / "copy.r3d")


def _lerobot_video(source: Source, out: Path) -> Path:
    lerobot.write_info(out)
    path = out / "videos" / lerobot.KEY / "chunk-000" / "file-000.mp4"
    return lerobot.write_video(path, [lerobot.codes_of(depth) for depth in source.depths])


def _lerobot_images(source: Source, out: Path) -> Path:
    lerobot.write_info(out)
    info = out / "meta" / "info.json"
    fields = json.loads(info.read_text())
    fields["features"][lerobot.KEY] = {"dtype": "image", "shape": [480, 640, 1], "info": {"is_depth_map": True}}
    info.write_text(json.dumps(fields))
    return lerobot.write_tiffs(out / "images" / lerobot.KEY / "episode-000000", source.stored)


def _oni(source: Source, out: Path) -> Path:
    camera = source.camera
    angles = 2 * math.atan(camera.width / 2 / camera.fx), 2 * math.atan(camera.height / 2 / camera.fy)
    return write_oni(out / "copy.oni", source.stored, field_of_view=angles)


def _data_set(name: str, source: Source, out: Path) -> Path:
    nothing, depths = np.full((len(source.depths), 21, 3), np.nan), source.depths
    mask, colour = np.zeros(source.camera.shape, dtype=np.bool_), np.zeros((*source.camera.shape, 3), dtype=np.uint8)
    if name == "MSRA15":
        return data_sets.write_msra15(out / "P0" / "1", depths)
    if name == "NYU":
        return data_sets.write_nyu(out / "test", depths)
    if name == "ICVL":
        return data_sets.write_icvl(out, depths, np.ones((len(depths), 16, 3)))
    if name == "DexYCB":
        return data_sets.write_dexycb(out, source.camera, depths, nothing, mask, colour)
    return data_sets.write_ho3d(out, source.camera, depths, nothing, colour)


_BYTES = "byte by byte"
FORMATS = (
    FormatCopy("folder (TUM RGB-D)", "depthtrack synth", _folder),
    FormatCopy("RealSense `.db3`", "pyrealsense2, software device", _realsense),
    FormatCopy("ROS 1 `.bag`", "rosbags", partial(_bag, ".bag")),
    FormatCopy("ROS 2 `.db3`", "rosbags", partial(_bag, ".db3")),
    FormatCopy("ROS 2 `.mcap`", "rosbags", partial(_bag, ".mcap")),
    FormatCopy("ROS 2 `.mcap`, RVL", "rosbags, RVL by a slow encoder", _rvl),
    FormatCopy("`.mcap`", "depthtrack convert", _converted),
    FormatCopy("Azure Kinect `.mkv`", _BYTES, _azure),
    FormatCopy("FFV1 `.mkv`", "PyAV", _ffv1, needs_camera=True),
    FormatCopy("Record3D `.r3d`", "zipfile, lzfse", _record3d),
    FormatCopy("LeRobot `.mp4`, 12 bits", "PyAV", _lerobot_video, needs_camera=True),
    FormatCopy("LeRobot TIFF", "Pillow", _lerobot_images, needs_camera=True),
    FormatCopy("OpenNI `.oni`", _BYTES, _oni),
    *(
        FormatCopy(name, writer, partial(_data_set, name), needs_camera=name in ("MSRA15", "NYU", "ICVL"))
        for name, writer in (
            ("MSRA15", _BYTES),
            ("NYU", "OpenCV"),
            ("ICVL", "OpenCV"),
            ("DexYCB", "OpenCV"),
            ("HO-3D", "OpenCV, pickle"),
        )
    ),
)

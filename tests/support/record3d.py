"""Files of Record3D, written as the app writes them."""

import json
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthtrack.geometry.camera import Camera
from depthtrack.recording import open_sequence

STORED = {"jpg": zipfile.ZIP_STORED, "depth": zipfile.ZIP_STORED}


def metadata(camera: Camera, times: Iterable[float], **fields: Any) -> dict[str, Any]:
    """The metadata of depth and colour with the pixels of `camera`."""
    return {
        "w": camera.width,
        "h": camera.height,
        "dw": camera.width,
        "dh": camera.height,
        "K": [camera.fx, 0, 0, 0, camera.fy, 0, camera.cx, camera.cy, 1],
        "fps": 30,
        "frameTimestamps": list(times),
        "poses": [],
        **fields,
    }


def write_r3d(
    path: Path, fields: dict[str, Any], depths: list[NDArray[np.float32]], jpegs: list[bytes] | None = None
) -> Path:
    """The metadata come first, then each frame."""
    import lzfse

    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        archive.writestr("metadata", json.dumps(fields))
        for number, depth in enumerate(depths):
            if jpegs is not None:
                archive.writestr(f"rgbd/{number}.jpg", jpegs[number])
            archive.writestr(f"rgbd/{number}.depth", lzfse.compress(depth.astype("<f4").tobytes()))
    return path


def copy_as_r3d(folder: Path, path: Path) -> Path:
    """The frames of a sequence folder with JPEGs of colour."""
    sequence = open_sequence(folder)
    jpegs = [file.read_bytes() for file in sorted((folder / "rgb").glob("*.jpg"))]
    depths = [frame.depth for frame in sequence]
    times = [float(time) for time in sequence.timestamps]
    return write_r3d(path, metadata(sequence.camera, times), depths, jpegs)

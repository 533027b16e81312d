"""Data sets of LeRobot with depth, written as its recorder writes them."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

KEY = "observation.images.front_depth"
QUANTISATION = {"video.depth_min": 0.01, "video.depth_max": 10.0, "video.shift": 3.5, "video.use_log": True}
LOSSLESS = {"x265-params": "lossless=1:keyint=4:bframes=0:log-level=none"}


def write_info(root: Path, info: Mapping[str, Any] | None = None, rate: float = 30) -> Path:
    """`meta/info.json` with a colour and a depth feature."""
    (root / "meta").mkdir(parents=True, exist_ok=True)
    colour = {"dtype": "video", "shape": [24, 32, 3], "info": {"video.pix_fmt": "yuv420p", "is_depth_map": False}}
    depth = {"dtype": "video", "shape": [24, 32, 1], "info": {"is_depth_map": True, **QUANTISATION, **(info or {})}}
    state = {"dtype": "float32", "shape": [6], "names": None}
    features = {"observation.state": state, "observation.images.front": colour, KEY: depth}
    (root / "meta" / "info.json").write_text(
        json.dumps({"codebase_version": "v3.0", "fps": rate, "features": features})
    )
    return root


def codes_of(depth: NDArray[np.float32], use_log: bool = True) -> NDArray[np.uint16]:
    """The 12-bit codes of depth, metres: the recorder's formula in its own order."""
    low, high, shift = 0.01, 10.0, 3.5
    if use_log:
        logs = np.log(low + shift), np.log(high + shift)
        share = (np.log(depth + shift) - logs[0]) / (logs[1] - logs[0])
    else:
        share = (depth - low) / (high - low)
    return np.rint(share * 4095).clip(0, 4095).astype(np.uint16)


def write_video(
    path: Path,
    frames: list[NDArray[np.uint16]],
    codec: str = "libx265",
    pixel_format: str = "gray12le",
    options: dict[str, str] | None = None,
    container: dict[str, str] | None = None,
    container_format: str = "mp4",
) -> Path:
    """A video whose first plane has the samples of `frames` (h, w)."""
    import av

    path.parent.mkdir(parents=True, exist_ok=True)
    height, width = frames[0].shape
    with av.open(str(path), "w", format=container_format, options=container or {}) as file:
        stream: Any = file.add_stream(codec, rate=30, options=LOSSLESS if options is None else options)
        stream.width, stream.height, stream.pix_fmt = width, height, pixel_format
        for number, samples in enumerate(frames):
            frame = av.VideoFrame(width, height, pixel_format)
            item = np.dtype(np.uint16 if pixel_format.endswith("le") else np.uint8)
            for number_of_plane, plane in enumerate(frame.planes):
                rows = np.zeros((plane.height, plane.line_size // item.itemsize), dtype=item)
                if number_of_plane == 0:
                    rows[:, :width] = samples.astype(item)
                plane.update(rows.tobytes())
            frame.pts = number
            file.mux(stream.encode(frame))
        file.mux(stream.encode())
    return path


def write_tiffs(folder: Path, depths: list[NDArray[Any]]) -> Path:
    """TIFF images of the type of the arrays."""
    folder.mkdir(parents=True)
    for number, depth in enumerate(depths):
        Image.fromarray(depth).save(folder / f"frame-{number:06d}.tiff")
    return folder

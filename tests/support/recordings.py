"""Small recordings for the tests of everything that reads them."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from depthtrack.geometry.camera import Camera
from depthtrack.hand.shape import HandShape
from depthtrack.recording import SequenceWriter

CAMERA = Camera(32, 24, 30.0, 30.5, 15.0, 11.0, 0.001)
TIMES = (0.0, 0.033, 0.067, 0.1, 0.4)


def depth_at(index: int) -> NDArray[np.float32]:
    """A tilted plane that moves away, with a hole in its corner."""
    depth = np.linspace(0.5, 0.9, CAMERA.width * CAMERA.height).reshape(CAMERA.shape) + 0.01 * index
    depth[:6, :8] = 0
    return depth.astype(np.float32)


def mask_at(index: int) -> NDArray[np.bool_]:
    mask = np.zeros(CAMERA.shape, dtype=np.bool_)
    mask[8:16, 5 + index : 15 + index] = True
    return mask


def colour_at(index: int) -> NDArray[np.uint8]:
    """Smooth, and different in every channel: a swap of red and blue shows."""
    row = np.linspace(0, 255, CAMERA.width)
    bands = np.stack([row, np.full_like(row, 40 + 10 * index), row[::-1] / 3], axis=-1)
    return np.broadcast_to(bands, (CAMERA.height, *bands.shape)).astype(np.uint8)


def pose_at(index: int) -> NDArray[np.float64]:
    turn = 0.1 * index
    return np.array([0.01, -0.02, 0.5 + 1e-3 * index, np.cos(turn), 0, np.sin(turn), 0, *np.linspace(0, 1 / 3, 20)])


def joints_at(index: int) -> NDArray[np.float64]:
    return np.random.default_rng(index).normal(0, 0.1, (21, 3))


def write_sample(path: Path) -> Path:
    """A recording with everything a sequence folder can hold."""
    description = {"motion": "plane", "seed": 3}
    with SequenceWriter(path, CAMERA, hand=HandShape(side="left"), description=description) as writer:
        for index, time in enumerate(TIMES):
            writer.append(
                time,
                depth_at(index),
                colour=colour_at(index),
                mask=mask_at(index),
                exact_depth=depth_at(index),
                pose=pose_at(index),
                joints=joints_at(index),
            )
    return path


def write_plain_tum(path: Path) -> Path:
    """Write a folder of the TUM RGB-D benchmark: no camera, 5000 units a metre, late colour."""
    (path / "depth").mkdir(parents=True)
    (path / "rgb").mkdir()
    depth_lines, colour_lines = ["# depth maps", "# timestamp filename"], ["# colour images"]
    for index, time in enumerate(TIMES):
        cv2.imwrite(str(path / f"depth/{time}.png"), np.rint(depth_at(index) * 5000).astype(np.uint16))
        cv2.imwrite(str(path / f"rgb/{index}.png"), colour_at(index)[..., ::-1])
        depth_lines.append(f"{time} depth/{time}.png")
        colour_lines.append(f"{time + 0.009} rgb/{index}.png")
    (path / "depth.txt").write_text("\n".join(depth_lines) + "\n")
    (path / "rgb.txt").write_text("\n".join(colour_lines) + "\n")
    return path

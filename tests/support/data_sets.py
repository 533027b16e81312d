"""Files of hand data sets, written byte by byte to their published formats."""

import io
import pickle
import struct
from pathlib import Path

import cv2
import numpy as np
import scipy.io
from numpy.typing import NDArray

from depthtrack.geometry.camera import Camera
from depthtrack.hand.benchmark_joints import BENCHMARKS

Depths = list[NDArray[np.float32]]
Joints = NDArray[np.float64]

NYU_ROWS = (0, 3, 6, 9, 12, 15, 18, 21, 24, 25, 27, 30, 31, 32)
HO3D_UNIT = 0.00012498664727900177


def write_msra15(folder: Path, depths: Depths, joints: Joints | None = None) -> Path:
    """depths (h, w) metres; joints (T, 21, 3) metres, camera frame, the benchmark's order."""
    folder.mkdir(parents=True)
    for number, depth in enumerate(depths):
        height, width = depth.shape
        rows, columns = (np.flatnonzero((depth > 0).any(axis=axis)) for axis in (1, 0))
        left, top, right, bottom = columns[0], rows[0], columns[-1] + 1, rows[-1] + 1
        data = struct.pack("<6I", width, height, left, top, right, bottom)
        data += (1000 * depth[top:bottom, left:right]).astype("<f4").tobytes()
        (folder / f"{number:06d}_depth.bin").write_bytes(data)
    if joints is not None:
        lines = [" ".join(f"{x:.4f}" for x in (1000 * frame * [1, -1, -1]).ravel()) for frame in joints]
        (folder / "joint.txt").write_text("\n".join([str(len(lines)), *lines]) + "\n")
    return folder


def write_nyu(
    folder: Path, depths: Depths, joints: Joints | None = None, colour: NDArray[np.uint8] | None = None
) -> Path:
    """joints (T, 14, 3) metres, camera frame; the other 22 joints are far away."""
    folder.mkdir(parents=True)
    for number, depth in enumerate(depths, start=1):
        mm = np.rint(1000 * depth).astype(np.uint16)
        packed = np.stack([mm & 255, mm >> 8, np.full_like(mm, 77)], axis=-1).astype(np.uint8)  # BGR
        cv2.imwrite(str(folder / f"depth_1_{number:07d}.png"), packed)
        cv2.imwrite(str(folder / f"depth_2_{number:07d}.png"), 255 - packed)
        if colour is not None:
            cv2.imwrite(str(folder / f"rgb_1_{number:07d}.png"), colour[..., ::-1])
    if joints is not None:
        xyz = np.full((3, len(joints), 36, 3), 9000.0)
        xyz[0][:, NYU_ROWS] = 1000 * joints * [1, -1, 1]
        scipy.io.savemat(folder / "joint_data.mat", {"joint_xyz": xyz, "joint_uvd": xyz}, do_compression=True)
    return folder


def write_icvl(root: Path, depths: Depths, joints: Joints) -> Path:
    """joints (T, 16, 3) metres, camera frame; returns the folder of the images."""
    folder = root / "Testing" / "Depth" / "test_seq_1"
    folder.mkdir(parents=True)
    pixels = BENCHMARKS["icvl"].camera.project(joints)
    lines = ["other_seq/image_0000.png" + " 1 2 3" * 16]
    for number, depth in enumerate(depths):
        name = f"image_{number:04d}.png"
        cv2.imwrite(str(folder / name), np.rint(1000 * depth).astype(np.uint16))
        uvd = np.column_stack([pixels[number], 1000 * joints[number, :, 2]])
        lines.append(f"test_seq_1/{name} " + " ".join(f"{x:.5f}" for x in uvd.ravel()) + " ")
    (root / "Testing" / "test_seq_1.txt").write_text("\n".join(lines) + "\n")
    return folder


def write_dexycb(
    root: Path, camera: Camera, depths: Depths, joints: Joints, mask: NDArray[np.bool_], colour: NDArray[np.uint8]
) -> Path:
    """joints (T, 21, 3) metres; NaN joints are written as not seen. Returns the folder."""
    folder = root / "20200709-subject-01" / "20200709_141754" / "836212060125"
    folder.mkdir(parents=True)
    for number, depth in enumerate(depths):
        stored = np.rint(1000 * depth).astype(np.uint16)
        cv2.imwrite(str(folder / f"aligned_depth_to_color_{number:06d}.png"), stored)
        cv2.imwrite(str(folder / f"color_{number:06d}.jpg"), colour[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 100])
        known = np.isfinite(joints[number]).all()
        xyz = joints[number] if known else np.full((21, 3), -1.0)
        data = io.BytesIO()
        np.savez_compressed(
            data,
            seg=np.where(mask, 255, 3).astype(np.uint8),
            joint_3d=xyz[None].astype(np.float32),
            pose_m=np.zeros((1, 51)),
        )
        (folder / f"labels_{number:06d}.npz").write_bytes(data.getvalue())
    calibration = root / "calibration" / "intrinsics"
    calibration.mkdir(parents=True)
    names = ("fx", camera.fx), ("fy", camera.fy), ("ppx", camera.cx), ("ppy", camera.cy)
    text = "color:\n" + "".join(f"  {name}: {value!r}\n" for name, value in names)
    text += "depth:\n" + "".join(f"  {name}: {2 * value!r}\n" for name, value in names)
    (calibration / f"836212060125_{camera.width}x{camera.height}.yml").write_text(text)
    return folder


def write_ho3d(root: Path, camera: Camera, depths: Depths, joints: Joints, colour: NDArray[np.uint8]) -> Path:
    """joints (T, J, 3) metres, camera frame, keypoint order; NaN frames are not annotated."""
    folder = root / "train" / "ABF10"
    for kind in ("depth", "rgb", "meta"):
        (folder / kind).mkdir(parents=True)
    K = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
    mano = np.argsort([0, 13, 14, 15, 16, 1, 2, 3, 17, 4, 5, 6, 18, 10, 11, 12, 19, 7, 8, 9, 20])
    for number, depth in enumerate(depths):
        stem = f"{2 * number:04d}"  # numbers with gaps, as in the data set
        units = np.rint(depth / HO3D_UNIT).astype(np.uint16)
        packed = np.stack([np.full_like(units, 99), units >> 8, units & 255], axis=-1).astype(np.uint8)  # BGR
        cv2.imwrite(str(folder / "depth" / f"{stem}.png"), packed)
        cv2.imwrite(str(folder / "rgb" / f"{stem}.jpg"), colour[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 100])
        seen = np.isfinite(joints[number]).all()
        fields = {
            "camMat": K,
            "handJoints3D": (joints[number] * [1, -1, -1])[mano] if seen else None,
            "objName": "021_bleach_cleanser",
            "handVertContact": np.zeros(778, dtype=np.bool_),
        }
        (folder / "meta" / f"{stem}.pkl").write_bytes(pickle.dumps(fields, protocol=2))
    return folder

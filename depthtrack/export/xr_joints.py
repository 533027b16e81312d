"""Export of the hand joints of OpenXR and WebXR to JSON or CSV.

Sources: the OpenXR Specification, XR_EXT_hand_tracking; W3C, WebXR Hand Input Module, Level 1. Both define the same
joints and axes. WebXR has other names and leaves the palm out.
"""

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.export.axes import export_transform, frame_text
from depthtrack.export.joint_track import JointTrack
from depthtrack.files import replace_atomically
from depthtrack.geometry.rotations import continuous, quaternion_from_matrix
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.openxr_joints import OPENXR_JOINTS, OPENXR_PARENTS, openxr_radii, openxr_transforms
from depthtrack.strict_data import exact_json_text
from depthtrack.types import Array

_DECIMALS = 9
"""Nanometres, and a similar share of a quaternion."""
_CELLS = ("x", "y", "z", "qx", "qy", "qz", "qw", "radius")


@dataclass(frozen=True)
class XrStandard:
    """Names of the joints of a standard, in its order.

    rows: (J,) number of each joint among `OPENXR_JOINTS`.
    """

    title: str
    joints: tuple[str, ...]
    rows: tuple[int, ...]

    @property
    def parents(self) -> list[int]:
        """Number (J,) of the joint before each, -1 for the wrist."""
        return [-1 if OPENXR_PARENTS[row] < 0 else self.rows.index(OPENXR_PARENTS[row]) for row in self.rows]


def _webxr_name(joint: str) -> str:
    finger, _, bone = joint.partition("_")
    named = f"{'pinky' if finger == 'little' else finger}-finger" if finger not in ("wrist", "thumb") else finger
    phalanx = "phalanx-" if bone in ("proximal", "intermediate", "distal") else ""
    return f"{named}-{phalanx}{bone}" if bone else named


OPENXR = XrStandard("OpenXR, XR_EXT_hand_tracking", OPENXR_JOINTS, tuple(range(26)))
WEBXR = XrStandard(
    "WebXR Hand Input Module", tuple(_webxr_name(joint) for joint in OPENXR_JOINTS[1:]), tuple(range(1, 26))
)


def write(standard: XrStandard, track: JointTrack, path: Path) -> None:
    """Write the joints of each frame as JSON, or as CSV if `path` ends in .csv.

    Raises:
        InputError: if the file cannot be written.
    """
    position, orientation = located_joints(standard, track)
    radius = openxr_radii(track.hand)[list(standard.rows)]
    with replace_atomically(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        if path.suffix.lower() == ".csv":
            csv.writer(file).writerows(_table(standard, track, position, orientation, radius))
        else:
            file.writelines(_json(standard, track, position, orientation, radius))


def located_joints(standard: XrStandard, track: JointTrack) -> tuple[Array, Array]:
    """Return positions (T, J, 3) and orientations (T, J, 4) of the joints.

    Positions are in metres, orientations are quaternions x y z w that keep their sign from frame to frame. The frame is
    that of `export.axes`. Both are NaN without a pose.
    """
    rows, posed = list(standard.rows), track.posed
    position = np.full((len(posed), len(rows), 3), np.nan)
    orientation = np.full((len(posed), len(rows), 4), np.nan)
    if posed.any():
        T = export_transform(track) @ openxr_transforms(HandModel(track.hand), track.poses[posed])[:, rows]
        position[posed] = T[..., :3, 3]
        orientation[posed] = continuous(quaternion_from_matrix(T[..., :3, :3]))[..., [1, 2, 3, 0]]
    return position, orientation


def _table(
    standard: XrStandard, track: JointTrack, position: Array, orientation: Array, radius: Array
) -> Iterator[list[Any]]:
    """Yield the header, then a row a frame; the cells of a frame without a pose are empty."""
    yield [
        *("index", "timestamp", "status", "confidence"),
        *(f"{j}_{cell}" for j in standard.joints for cell in _CELLS),
    ]
    for row, index in enumerate(track.index.tolist()):
        values = np.concatenate([position[row], orientation[row], radius[:, None]], axis=1).round(_DECIMALS)
        cells = values.ravel().tolist() if track.posed[row] else [""] * values.size
        yield [index, float(track.timestamps[row]), track.status[row].value, _confidence(track, row), *cells]


def _json(standard: XrStandard, track: JointTrack, position: Array, orientation: Array, radius: Array) -> Iterator[str]:
    """Yield the text of the JSON file; a frame has a line."""
    head = {
        "standard": standard.title,
        "side": track.hand.side,
        "length": "m",
        "time": "s",
        "frame": frame_text(track),
        "quaternion": "x y z w",
        "joints": list(standard.joints),
        "parents": standard.parents,
        "radius": radius.round(_DECIMALS).tolist(),
    }
    yield exact_json_text(head, indent=1)[:-2] + ',\n "frames": ['
    for row, index in enumerate(track.index.tolist()):
        frame: dict[str, Any] = {
            "index": index,
            "timestamp": float(track.timestamps[row]),
            "status": track.status[row].value,
            "confidence": _confidence(track, row) or None,
            "active": bool(track.posed[row]),
        }
        if frame["active"]:
            frame["position"] = position[row].round(_DECIMALS).tolist()
            frame["orientation"] = orientation[row].round(_DECIMALS).tolist()
        yield (",\n" if row else "\n") + exact_json_text(frame)
    yield "\n]}\n"


def _confidence(track: JointTrack, row: int) -> float | str:
    value = float(track.confidence[row])
    return round(value, 6) if np.isfinite(value) else ""

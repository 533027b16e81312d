"""Files of OpenXR and WebXR joints, read again by json, csv and scipy alone."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from depthtrack.export.registry import export_joints
from depthtrack.export.xr_joints import OPENXR, WEBXR, XrStandard
from depthtrack.hand.openxr_joints import OPENXR_JOINTS
from depthtrack.hand.shape import HandShape, Side
from depthtrack.types import Array
from tests.support.tracks import moving_poses, track_of

STANDARDS = {"openxr": OPENXR, "webxr": WEBXR}
FRAMES, ABSENT = 6, 2


@pytest.fixture(params=["right", "left"])
def side(request: pytest.FixtureRequest) -> Side:
    chosen: Side = request.param
    return chosen


def poses() -> Array:
    made = moving_poses(FRAMES)
    made[ABSENT] = np.nan
    return made


def read_json(path: Path) -> dict[str, Any]:
    def reject(name: str) -> None:
        raise AssertionError(f"JSON has no {name}")

    content: dict[str, Any] = json.loads(path.read_text(), parse_constant=reject)
    return content


@pytest.mark.parametrize("name", STANDARDS)
def test_exported_rotations_place_the_exported_joints(tmp_path: Path, name: str, side: Side) -> None:
    """Forward kinematics with constant offsets in the parents' frames."""
    export_joints(tmp_path / "a.json", track_of(poses(), HandShape(side=side)), name)
    content = read_json(tmp_path / "a.json")
    active = [frame for frame in content["frames"] if frame["active"]]
    assert len(active) == FRAMES - 1
    position = np.array([frame["position"] for frame in active])
    rotation = np.array([Rotation.from_quat(frame["orientation"]).as_matrix() for frame in active])
    order = sorted(range(len(content["joints"])), key=lambda j: _depth(content["parents"], j))
    placed, turned = position.copy(), rotation.copy()
    for joint in order:
        if (parent := content["parents"][joint]) >= 0:
            offset = rotation[0, parent].T @ (position[0, joint] - position[0, parent])
            local = rotation[:, parent].swapaxes(-1, -2) @ rotation[:, joint]
            turned[:, joint] = turned[:, parent] @ local
            placed[:, joint] = placed[:, parent] + turned[:, parent] @ offset
    np.testing.assert_allclose(placed, position, atol=1e-7)
    assert content["side"] == side


def _depth(parents: list[int], joint: int) -> int:
    return 0 if parents[joint] < 0 else 1 + _depth(parents, parents[joint])


def test_the_joints_are_ours_with_y_up_and_z_backward(tmp_path: Path, side: Side) -> None:
    track = track_of(poses(), HandShape(side=side))
    export_joints(tmp_path / "a.json", track, "openxr")
    frame = read_json(tmp_path / "a.json")["frames"][4]
    located = dict(zip(OPENXR_JOINTS, np.array(frame["position"]), strict=True))
    for ours, name in {0: "wrist", 4: "thumb_tip", 5: "index_proximal", 20: "little_tip"}.items():
        np.testing.assert_allclose(located[name] * [1, -1, -1], track.keypoints[4, ours], atol=1e-8)


@pytest.mark.parametrize(("name", "standard"), STANDARDS.items())
def test_csv_and_json_hold_the_same_numbers(tmp_path: Path, name: str, standard: XrStandard, side: Side) -> None:
    track = track_of(poses(), HandShape(side=side))
    export_joints(tmp_path / "a.json", track, name)
    export_joints(tmp_path / "a.csv", track, name)
    content = read_json(tmp_path / "a.json")
    with (tmp_path / "a.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(content["frames"]) == FRAMES
    assert [row["status"] for row in rows] == ["tracked"] * 2 + ["absent"] + ["tracked"] * 3
    for row, frame in zip(rows, content["frames"], strict=True):
        assert (int(row["index"]), float(row["timestamp"])) == (frame["index"], frame["timestamp"])
        if not frame["active"]:
            assert {cell for column, cell in row.items() if column.startswith("wrist")} == {""}
            continue
        for number, joint in enumerate(standard.joints):
            cells = [float(row[f"{joint}_{cell}"]) for cell in ("x", "y", "z", "qx", "qy", "qz", "qw", "radius")]
            expected = [*frame["position"][number], *frame["orientation"][number], content["radius"][number]]
            assert cells == expected


def test_webxr_names_the_25_joints_of_openxr_after_the_palm() -> None:
    assert len(WEBXR.joints) == 25
    assert WEBXR.joints[:6] == (
        *("wrist", "thumb-metacarpal", "thumb-phalanx-proximal", "thumb-phalanx-distal", "thumb-tip"),
        "index-finger-metacarpal",
    )
    assert WEBXR.joints[-2:] == ("pinky-finger-phalanx-distal", "pinky-finger-tip")
    assert WEBXR.joints[12] == "middle-finger-phalanx-intermediate"
    assert WEBXR.parents[:3] == [-1, 0, 1]


def test_quaternions_keep_their_sign_from_frame_to_frame(tmp_path: Path) -> None:
    export_joints(tmp_path / "a.json", track_of(moving_poses(200)), "openxr")
    turned = np.array([frame["orientation"] for frame in read_json(tmp_path / "a.json")["frames"]])
    assert np.all(np.sum(turned[1:] * turned[:-1], axis=-1) > 0)


def test_a_run_without_a_pose_has_inactive_frames(tmp_path: Path) -> None:
    export_joints(tmp_path / "a.json", track_of(np.full((2, 27), np.nan)), "webxr")
    assert [frame["active"] for frame in read_json(tmp_path / "a.json")["frames"]] == [False, False]

"""Camera files of Open3D, RealSense, ROS, Kalibr and OpenCV give the same camera."""

import json
from pathlib import Path
from typing import Any

import pytest

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.camera_files import read_camera

CAMERA = Camera(640, 480, 525.0, 520.0, 319.5, 239.5)
COEFFICIENTS = (0.1, -0.2, 0.001, -0.002, 0.05)
MATRIX = [525.0, 0.0, 319.5, 0.0, 520.0, 239.5, 0.0, 0.0, 1.0]
COLUMNS = [525.0, 0.0, 0.0, 0.0, 520.0, 0.0, 319.5, 239.5, 1.0]
NUMBERS = {"fx": 525.0, "fy": 520.0, "cx": 319.5, "cy": 239.5}
SIZE = {"width": 640, "height": 480}

ROS = """image_width: 640
image_height: 480
camera_name: depth
camera_matrix:
  rows: 3
  cols: 3
  data: [525.0, 0.0, 319.5, 0.0, 520.0, 239.5, 0.0, 0.0, 1.0]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [0.1, -0.2, 0.001, -0.002, 0.05]
"""
ROS_TOPIC = """header:
  frame_id: camera_depth_optical_frame
height: 480
width: 640
distortion_model: plumb_bob
d: [0.1, -0.2, 0.001, -0.002, 0.05]
k: [525.0, 0.0, 319.5, 0.0, 520.0, 239.5, 0.0, 0.0, 1.0]
---
"""
KALIBR = """cam0:
  camera_model: pinhole
  intrinsics: [525.0, 520.0, 319.5, 239.5]
  distortion_model: radtan
  distortion_coeffs: [0.1, -0.2, 0.001, -0.002]
  resolution: [640, 480]
"""
OPENCV = """%YAML:1.0
---
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 525., 0., 319.5, 0., 520., 239.5, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ 0.1, -0.2, 0.001, -0.002, 0.05 ]
"""
JSON_FILES: dict[str, dict[str, Any]] = {
    "Open3D": {**SIZE, "intrinsic_matrix": COLUMNS},
    "Open3D with the recorder's unit": {**SIZE, "intrinsic_matrix": COLUMNS, "depth_scale": 1000.0},
    "Open3D with extrinsics": {
        "class_name": "x",
        "extrinsic": [1.0],
        "intrinsic": {**SIZE, "intrinsic_matrix": COLUMNS},
    },
    "RealSense": {**SIZE, "fx": 525.0, "fy": 520.0, "ppx": 319.5, "ppy": 239.5, "model": "x", "coeffs": [0.0] * 5},
    "a matrix of rows": {**SIZE, "K": [MATRIX[:3], MATRIX[3:6], MATRIX[6:]]},
    "whole numbers as floats": {**NUMBERS, "width": 640.0, "height": 480.0, "depth_scale": 0.001},
    "a negative fy": {**SIZE, **NUMBERS, "fy": -520.0},
}
YAML_FILES = {"ROS": ROS, "a topic of ROS": ROS_TOPIC, "Kalibr": KALIBR, "OpenCV": OPENCV}


@pytest.mark.parametrize("kind", JSON_FILES)
def test_json_of_other_tools_gives_the_camera(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "camera.json"
    path.write_text(json.dumps(JSON_FILES[kind]))
    file = read_camera(path)
    assert file.camera == CAMERA
    assert file.distortion == ()
    assert any("1 mm" in note for note in file.notes) == ("depth_scale" not in JSON_FILES[kind])


@pytest.mark.parametrize("kind", YAML_FILES)
def test_yaml_of_other_tools_gives_the_camera_and_its_distortion(tmp_path: Path, kind: str) -> None:
    pytest.importorskip("yaml", reason="the extra 'yaml' is not installed")
    path = tmp_path / "camera_info.yaml"
    path.write_text(YAML_FILES[kind])
    file = read_camera(path)
    assert file.camera == CAMERA
    known = COEFFICIENTS[:4] if kind == "Kalibr" else COEFFICIENTS
    assert file.distortion == (*known, *(0.0,) * (8 - len(known)))


@pytest.mark.parametrize(
    "fields", [{"k1": 0.1, "k2": -0.2}, {"distortion": [0.1, -0.2]}, {"dist_coeffs": [[0.1, -0.2]]}]
)
def test_distortion_in_our_own_file_is_found(tmp_path: Path, fields: dict[str, Any]) -> None:
    path = tmp_path / "camera.json"
    path.write_text(json.dumps({**SIZE, **NUMBERS, **fields}))
    assert read_camera(path).distortion == (0.1, -0.2, *(0.0,) * 6)


REFUSED: dict[str, tuple[str, str, str]] = {
    "a fish-eye lens": (".yaml", KALIBR.replace("radtan", "equidistant"), "undistort the images first"),
    "no size": (".yaml", KALIBR.replace("resolution", "r"), "must be a JSON object with width, height"),
    "a list": (".yaml", "- 1\n- 2\n", "must be a JSON object"),
    "nothing": (".yaml", "", "must be a JSON object"),
    "half a file": (".yaml", KALIBR[:-8], "cannot read the camera file"),
    "a program": (".yaml", "!!python/object/apply:os.system ['true']", "cannot read the camera file"),
    "text as a coefficient": (".json", json.dumps({**SIZE, **NUMBERS, "k1": "0.1"}), "distortion must be numbers"),
    "half a pixel": (".json", json.dumps({**NUMBERS, "width": 640.5, "height": 480}), "width must be a whole number"),
    "both signs": (".json", json.dumps({**SIZE, **NUMBERS, "fx": -525.0, "fy": -520.0}), "fx must be a focal length"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_a_camera_that_cannot_be_used_gives_one_sentence(tmp_path: Path, kind: str) -> None:
    suffix, text, message = REFUSED[kind]
    if suffix == ".yaml":
        pytest.importorskip("yaml", reason="the extra 'yaml' is not installed")
    path = tmp_path / f"camera{suffix}"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_camera(path)
    assert "\n" not in str(caught.value)

"""Cameras: projection, crops, resampling, and files that are not cameras."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.errors import InputError
from depthtrack.geometry.camera import PRESETS, Camera
from depthtrack.geometry.camera_files import read_camera
from depthtrack.geometry.rectangle import Rect

CAMERA = Camera(640, 480, 525.0, 520.0, 319.5, 239.5)
FIELDS = json.loads(CAMERA.to_json())


@given(
    u=st.floats(-100, 800),
    v=st.floats(-100, 600),
    z=st.floats(0.1, 5),
    left=st.integers(-50, 600),
    top=st.integers(-50, 400),
)
def test_unprojection_inverts_projection_in_every_crop(u: float, v: float, z: float, left: int, top: int) -> None:
    point = CAMERA.unproject([u, v], z)
    np.testing.assert_allclose(CAMERA.project(point), [u, v], atol=1e-6)
    region = CAMERA.crop(Rect.of_size(left, top, 96, 64))
    np.testing.assert_allclose(region.project(point), [u - left, v - top], atol=1e-6)
    assert region.shape == (64, 96)


@given(z=st.floats(0.2, 3), x=st.floats(-0.5, 0.5))
def test_resizing_keeps_corners_aligned(z: float, x: float) -> None:
    half = CAMERA.resized(0.5)
    full_uv, half_uv = CAMERA.project([x, x, z]), half.project([x, x, z])
    np.testing.assert_allclose((full_uv + 0.5) / 2, half_uv + 0.5, atol=1e-9)
    assert half.shape == (240, 320)


def test_points_behind_the_camera_have_no_pixel() -> None:
    assert np.isnan(CAMERA.project([0.1, 0.1, -1.0])).all()


def test_json_round_trip(tmp_path: Path) -> None:
    for camera in (CAMERA, *PRESETS.values()):
        path = tmp_path / "camera.json"
        path.write_text(camera.to_json())
        assert read_camera(path).camera == camera


@pytest.mark.parametrize(
    "change",
    [
        {"width": 0},
        {"width": 10**9},
        {"height": 479.5},
        {"fx": 0},
        {"fx": -525},
        {"fy": 0.0},
        {"fy": 5e7},
        {"cx": 1e6},
        {"cy": "middle"},
        {"depth_scale": 0},
        {"depth_scale": 1000},
        {"fx": True},
    ],
)
def test_cameras_out_of_range_are_rejected_by_name(tmp_path: Path, change: dict[str, object]) -> None:
    path = tmp_path / "camera.json"
    path.write_text(json.dumps({**FIELDS, **change}))
    with pytest.raises(InputError, match=next(iter(change))):
        read_camera(path)


@pytest.mark.parametrize("text", ["", "[]", "{}", "{'width': 1}", '{"width": 640}'])
def test_files_that_are_not_cameras_are_rejected(tmp_path: Path, text: str) -> None:
    path = tmp_path / "camera.json"
    path.write_text(text)
    with pytest.raises(InputError, match=r"camera\.json"):
        read_camera(path)

"""Lens distortion agrees with OpenCV, and undistorted images with those of a pinhole camera."""

import cv2
import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.distortion import Distortion, Undistortion

CAMERA = Camera(160, 120, 130.0, 128.0, 81.0, 58.0)
BROWN = (-0.28, 0.09, 0.001, -0.0007, -0.01)
RATIONAL = (0.52, -2.7, 0.0007, -0.0003, 1.5, 0.4, -2.5, 1.45)


@pytest.mark.parametrize("coefficients", [BROWN, RATIONAL, (-0.2, 0.05, 0.0, 0.0)])
def test_rays_are_distorted_as_by_opencv(coefficients: tuple[float, ...]) -> None:
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-0.6, 0.6, (2, 50))
    points = np.stack([x, y, np.ones(50)], axis=1)
    expected, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), np.eye(3), np.array(coefficients))
    np.testing.assert_allclose(np.stack(Distortion(coefficients).distort(x, y), axis=1), expected[:, 0], atol=1e-12)


def test_rays_beyond_the_range_of_the_model_are_unknown() -> None:
    x = np.array([0.1, 3.0])
    assert np.isnan(Distortion((-0.28,)).distort(x, np.zeros(2))[0]).tolist() == [False, True]


def distorted_plane(distortion: Distortion) -> np.ndarray:
    """Return the depth of a tilted plane as a lens with distortion sees it."""
    u, v = np.meshgrid(np.arange(CAMERA.width), np.arange(CAMERA.height))
    seen = (u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy
    x, y = seen
    for _ in range(60):
        a, b = distortion.distort(x, y)
        x, y = x + seen[0] - a, y + seen[1] - b
    return (0.6 / (1 + 0.3 * x - 0.2 * y)).astype(np.float32)


@pytest.mark.parametrize("coefficients", [BROWN, (0.05, -0.02, 0.002, 0.001)])
def test_an_undistorted_plane_is_a_plane(coefficients: tuple[float, ...]) -> None:
    distortion = Distortion(coefficients)
    undistortion = Undistortion(CAMERA, distortion)
    u, v = np.meshgrid(np.arange(CAMERA.width), np.arange(CAMERA.height))
    x, y = (u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy
    found = undistortion.depth(distorted_plane(distortion))
    inner = np.s_[8:-8, 8:-8]
    assert (found[inner] > 0).mean() > 0.9
    error = np.abs(found - 0.6 / (1 + 0.3 * x - 0.2 * y))[inner][found[inner] > 0]
    assert np.percentile(error, 99) < 1e-5
    assert undistortion.pixels > 1


def test_an_edge_of_depth_is_not_interpolated() -> None:
    depth = np.where(np.arange(CAMERA.width) < 70, np.float32(0.5), np.float32(1.5)) * np.ones(
        (CAMERA.height, 1), np.float32
    )
    depth[40:50] = 0
    found = Undistortion(CAMERA, Distortion(BROWN)).depth(depth)
    assert set(np.unique(found)) <= {np.float32(0), np.float32(0.5), np.float32(1.5)}


def test_colour_moves_with_the_depth() -> None:
    undistortion = Undistortion(CAMERA, Distortion(BROWN))
    half = (np.arange(CAMERA.width) < 30) & np.ones((CAMERA.height, 1), dtype=bool)
    colour = undistortion.colour((half[..., None] * np.array([200, 100, 50])).astype(np.uint8))
    depth = undistortion.depth(np.where(half, np.float32(0.5), np.float32(1.5)))
    inner = np.s_[4:-4, 4:-4]
    agree = (colour[..., 0] > 100) == (depth == np.float32(0.5))
    assert agree[inner][depth[inner] > 0].mean() > 0.98


def test_unusable_coefficients_are_rejected() -> None:
    assert Distortion.of("equidistant", [0, 0, 0, 0]) is None
    assert Distortion.of("plumb_bob", BROWN) == Distortion(BROWN)
    with pytest.raises(InputError, match="plumb_bob or rational"):
        Distortion.of("equidistant", [0.1, 0, 0, 0])
    with pytest.raises(InputError, match="at most 8"):
        Distortion((0.1,) * 12)
    with pytest.raises(InputError, match="within"):
        Distortion((float("nan"),))


def test_depth_between_readings_is_interpolated_up_to_the_last_pixel() -> None:
    """The slow form: each place by itself, from the four readings around it."""
    undistortion = Undistortion(CAMERA, Distortion(BROWN))
    depth = distorted_plane(Distortion(BROWN))
    found = undistortion._interpolated(depth)
    height, width = depth.shape
    for row, column in np.random.default_rng(0).integers(0, [height, width], (200, 2)):
        u, v = float(undistortion._across[row, column]), float(undistortion._down[row, column])
        if 0 <= u <= width - 1 and 0 <= v <= height - 1:
            left, top = min(int(u), width - 2), min(int(v), height - 2)
            weights = np.outer([top + 1 - v, v - top], [left + 1 - u, u - left])
            expected = float((weights * depth[top : top + 2, left : left + 2]).sum())
            assert found[row, column] == pytest.approx(expected, abs=1e-6)

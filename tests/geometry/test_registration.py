"""Colour is registered to depth in a synthetic scene that two cameras see."""

import cv2
import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.distortion import Distortion
from depthtrack.geometry.registration import Registration
from depthtrack.types import Array, Depth, Image, Mask

DEPTH = Camera(160, 120, 130.0, 131.0, 79.0, 60.0)
COLOUR = Camera(320, 200, 240.0, 241.0, 162.0, 97.0)
NEAR, FAR = 0.5, 0.9
RED, BLUE = (200, 20, 20), (20, 20, 200)
SQUARE = 0.07
"""Half a side of a red square at NEAR before a blue wall at FAR, metres."""


def transform(degrees: float, *translation: float) -> Array:
    T = np.eye(4)
    T[:3, :3] = cv2.Rodrigues(np.radians([0.3, degrees, -0.2]))[0]
    T[:3, 3] = translation
    return T


T_COLOUR_DEPTH = transform(4.0, -0.06, 0.002, 0.004)
DISTORTION = Distortion((0.08, -0.12, 0.0008, -0.0005, 0.03))


def seen(camera: Camera, T_camera_world: Array, distortion: Distortion | None = None) -> tuple[Depth, Image]:
    """Return depth and colour of the scene by ray casting, in the frame of the depth camera."""
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    a, b = (u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy
    x, y = a, b
    if distortion is not None:
        for _ in range(15):
            dx, dy = distortion.distort(x, y)
            x, y = x + a - dx, y + b - dy
    T_world_camera = np.linalg.inv(T_camera_world)
    rays = np.stack([x, y, np.ones_like(x)], axis=-1) @ T_world_camera[:3, :3].T
    origin = T_world_camera[:3, 3]
    near, far = ((z - origin[2]) / rays[..., 2] for z in (NEAR, FAR))
    point = origin + near[..., None] * rays
    hit = (np.abs(point[..., 0]) < SQUARE) & (np.abs(point[..., 1]) < SQUARE)
    colour = np.where(hit[..., None], np.array(RED), np.array(BLUE)).astype(np.uint8)
    return np.where(hit, near, far).astype(np.float32), colour


def near_edges(colour: Image) -> Mask:
    """Return the pixels (h, w) near the edge of the square."""
    return np.asarray(cv2.dilate(cv2.Canny(colour[..., 0], 50, 100), np.ones((5, 5), np.uint8)) > 0)


@pytest.mark.parametrize("distortion", [None, DISTORTION])
def test_each_pixel_has_the_colour_of_its_surface(distortion: Distortion | None) -> None:
    depth, expected = seen(DEPTH, np.eye(4))
    _, colour = seen(COLOUR, T_COLOUR_DEPTH, distortion)
    found = Registration(DEPTH, COLOUR, T_COLOUR_DEPTH, distortion)(depth, colour)
    inside = np.asarray(found.any(axis=-1))
    # Away from the edge of the square, where one pixel of either camera mixes both surfaces.
    edges = near_edges(expected)
    agree = np.abs(found.astype(int) - expected).max(axis=-1) < 10
    assert agree[inside & ~edges].mean() > 0.999
    assert inside[depth < 0.7].mean() > 0.99
    # Without registration the square would be elsewhere by more than its own half.
    assert (colour[::2, ::2][: DEPTH.height, : DEPTH.width] == expected[:100]).all(axis=-1).mean() < 0.95


def test_hidden_points_get_no_colour_of_what_hides_them() -> None:
    depth, expected = seen(DEPTH, np.eye(4))
    _, colour = seen(COLOUR, T_COLOUR_DEPTH)
    found = Registration(DEPTH, COLOUR, T_COLOUR_DEPTH)(depth, colour)
    wall = depth > 0.7
    edges = near_edges(expected)
    red = found[..., 0] > 100
    assert red[wall & ~edges].sum() == 0
    # The shadow of the square on the wall is as wide as the parallax.
    shadow = np.asarray(~found.any(axis=-1) & wall & ~edges)[DEPTH.height // 2]
    parallax = DEPTH.fx * 0.06 * (1 / NEAR - 1 / FAR)
    assert 0.5 * parallax < np.count_nonzero(shadow[20:140]) < 1.2 * parallax


def test_pixels_without_depth_have_no_colour() -> None:
    depth = np.zeros(DEPTH.shape, np.float32)
    assert not Registration(DEPTH, COLOUR, T_COLOUR_DEPTH)(depth, np.full((*COLOUR.shape, 3), 9, np.uint8)).any()


def test_equal_cameras_at_one_place_change_no_colour() -> None:
    depth, colour = seen(DEPTH, np.eye(4))
    found = Registration(DEPTH, DEPTH, np.eye(4))(depth, colour)
    coloured = np.asarray(found.any(axis=-1))
    np.testing.assert_array_equal(found[coloured], colour[coloured])
    # The wall loses the pixels beside the square.
    assert coloured[depth < 0.7].all()
    assert coloured.mean() > 0.98


def test_impossible_transforms_and_sizes_are_rejected() -> None:
    with pytest.raises(InputError, match="rigid"):
        Registration(DEPTH, COLOUR, 2 * np.eye(4))
    with pytest.raises(InputError, match="at most 1 m apart"):
        Registration(DEPTH, COLOUR, transform(0, 60, 0, 0))
    with pytest.raises(InputError, match="expects depth"):
        Registration(DEPTH, COLOUR, np.eye(4))(np.zeros((3, 3), np.float32), np.zeros((2, 2, 3), np.uint8))

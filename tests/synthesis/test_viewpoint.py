"""Viewpoints: positions, directions and the image of the hand."""

from itertools import combinations

import numpy as np
import pytest

from depthtrack.hand.shape import HandShape
from depthtrack.synthesis.viewpoint import VIEWPOINT_COUNT, Viewpoint
from tests.support.synthesis import synthesiser


def test_viewpoints_are_distinct_on_a_hemisphere_and_directed_at_the_hand() -> None:
    views = [Viewpoint(n, 0.8) for n in range(VIEWPOINT_COUNT)]
    assert len(views) == 8
    positions = []
    for view in views:
        T = view.transform
        np.testing.assert_allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-12)
        assert np.linalg.det(T[:3, :3]) == pytest.approx(1)
        np.testing.assert_allclose(view.transform_points(np.zeros(3)), [0, 0, 0.8], atol=1e-12)
        positions.append(-T[:3, :3].T @ T[:3, 3])
    assert np.all(np.array(positions)[:, 2] < 0)  # all are on the frontal hemisphere
    assert min(np.linalg.norm(a - b) for a, b in combinations(positions, 2)) > 2 * 0.8 * np.sin(np.radians(15))
    np.testing.assert_allclose(views[0].transform[:3, :3], np.eye(3), atol=1e-12)


def test_every_viewpoint_sees_the_same_hand_at_the_same_distance() -> None:
    frames = [synthesiser(viewpoint=n, distance=0.7)[100] for n in range(VIEWPOINT_COUNT)]
    sizes = [np.linalg.norm(f.joints[:, None] - f.joints[None], axis=-1) for f in frames]
    for frame, size in zip(frames, sizes, strict=True):
        np.testing.assert_allclose(size, sizes[0], atol=1e-12)
        assert np.linalg.norm(frame.pose[:3]) == pytest.approx(0.7, abs=0.05)
        assert frame.mask.sum() > 2000


def test_distance_and_scale_change_the_size_of_the_hand_in_the_image() -> None:
    area = {d: synthesiser(distance=d)[0].mask.sum() for d in (0.5, 1.0, 2.5)}
    assert area[0.5] / area[1.0] == pytest.approx(4, rel=0.1)
    assert area[0.5] / area[2.5] == pytest.approx(25, rel=0.1)
    assert synthesiser(hand=HandShape(scale=0.8))[0].mask.sum() / area[0.5] == pytest.approx(0.64, rel=0.1)

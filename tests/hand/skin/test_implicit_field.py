"""The compiled distance to the implicit hand, against plain numpy."""

import numpy as np
import pytest

from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.implicit import ImplicitHand
from depthtrack.hand.skin.implicit_field import Cone, Web


def _cone(cone: Cone, points: np.ndarray) -> np.ndarray:
    axis = cone.end - cone.start
    t = np.clip((points - cone.start) @ axis / (axis @ axis), 0, 1)
    across = points - cone.start - t[:, None] * axis
    return np.linalg.norm(across, axis=1) - (cone.radius_start + t * (cone.radius_end - cone.radius_start))


def _web(web: Web, points: np.ndarray) -> np.ndarray:
    near, far = (web.one + web.other) / 2
    along = far - near
    t = np.clip((points - near) @ along / (along @ along), 0, 1)[:, None]
    start, end = (edge[0] + t * (edge[1] - edge[0]) for edge in (web.one, web.other))
    strand = end - start
    s = np.clip(np.sum((points - start) * strand, axis=1) / np.sum(strand**2, axis=1), 0, 1)
    across = points - start - s[:, None] * strand
    return np.linalg.norm(across, axis=1) - (web.radius_near + t[:, 0] * (web.radius_far - web.radius_near))


def _union(a: np.ndarray, b: np.ndarray, k: float) -> np.ndarray:
    return np.minimum(a, b) - np.maximum(k - np.abs(a - b), 0) ** 2 / (4 * k)


def _finger(hand: ImplicitHand, points: np.ndarray, finger: int) -> np.ndarray:
    first, *others = (_cone(cone, points) for cone in hand.fingers[finger])
    for other in others:
        first = _union(first, other, 0.25 * hand.shape.radii[finger, 3])
    return first


def _palm(hand: ImplicitHand, points: np.ndarray) -> np.ndarray:
    first, *others = (np.min([_cone(cone, points) for cone in ray], axis=0) for ray in hand.palm)
    for other in others:
        first = _union(first, other, 0.1 * hand.shape.palm_length)
    return np.asarray(first)


def _whole(hand: ImplicitHand, points: np.ndarray) -> np.ndarray:
    unit, body = hand.shape.palm_length, _palm(hand, points)
    for muscle in hand.muscles:
        body = _union(body, _cone(muscle, points), 0.12 * unit)
    for web in hand.webs:
        body = _union(body, _web(web, points), 0.07 * unit)
    body = -_union(-body, points[:, 1] - hand.shape.wrist[1] + 0.02 * unit, 0.14 * unit)
    fillets = [0.12, 0.05, 0.05, 0.05, 0.05]
    return np.min([_union(body, _finger(hand, points, f), fillets[f] * unit) for f in range(5)], axis=0)


@pytest.mark.parametrize("shape", [HandShape(), HandShape(side="left", scale=0.8, palm_breadth=0.09)])
def test_distances_are_those_of_numpy(shape: HandShape) -> None:
    hand = ImplicitHand.of(shape)
    low, high = hand.bounds()
    points = low + (high - low) * np.random.default_rng(1).random((1001, 3))
    np.testing.assert_allclose(hand.distance(points), _whole(hand, points), atol=1e-15)
    np.testing.assert_allclose(hand.distance(points[:, ::-1][:, ::-1]), hand.distance(points), atol=0)
    to_palm, to_fingers = hand.part_distances(points)
    np.testing.assert_allclose(to_palm, _palm(hand, points), atol=1e-15)
    for finger in range(5):
        np.testing.assert_allclose(to_fingers[:, finger], _finger(hand, points, finger), atol=1e-15)
    assert len(hand.distance(points[:0])) == 0

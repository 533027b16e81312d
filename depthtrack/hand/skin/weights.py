"""Skinning weights of the bodies on the built skin: smooth, convex, and within one finger.

Along a finger the weight passes from one bone to the next around each joint, over about one radius to each side.
Across the hand it depends on the distance to each finger, so that a web follows both adjacent fingers.
"""

import numpy as np

from depthtrack.geometry.isosurface import neighbour_average
from depthtrack.hand.compiled_kinematics import BODY_COUNT
from depthtrack.hand.kinematics import body_of
from depthtrack.hand.skin.implicit import ImplicitHand
from depthtrack.types import Array, Faces

_BLEND = (1.4, 1.0, 1.0)
"""Half the width of the transition at each joint of a finger, in radii; widest over a knuckle."""


def skin_weights(solid: ImplicitHand, vertices: Array, faces: Faces) -> Array:
    """Return convex weights (V, 16) of vertices (V, 3) on the skin at rest, palm frame, metres."""
    to_palm, to_finger = solid.part_distances(vertices)
    weights = np.zeros((len(vertices), BODY_COUNT))

    # The thumb shares its muscles with the palm: half each at equal distance.
    unit = solid.shape.palm_length
    elsewhere = np.minimum(to_palm, to_finger[:, 1:].min(axis=-1))
    thumb = _step((elsewhere - to_finger[:, 0]) / (0.2 * unit))
    # Between the other fingers the web belongs to both.
    nearness = -to_finger[:, 1:] / (0.02 * unit)
    nearness = np.exp(nearness - nearness.max(axis=-1, keepdims=True))
    nearness /= nearness.sum(axis=-1, keepdims=True)
    share = np.concatenate([thumb[:, None], (1 - thumb[:, None]) * nearness], axis=-1)

    for finger in range(5):
        chain = share[:, finger, None] * _along(solid, finger, vertices, to_finger[:, finger])
        weights[:, 0] += chain[:, 0]
        weights[:, body_of(finger, 0) : body_of(finger, 2) + 1] += chain[:, 1:]
    average = neighbour_average(faces, len(vertices))
    for _ in range(4):
        weights = 0.5 * (weights + average @ weights)
    # Four bodies a vertex are what rigged files and graphics cards usually carry.
    fourth = np.sort(weights, axis=-1)[:, -4:-3]
    weights[weights < np.maximum(fourth, 1e-3)] = 0
    return np.asarray(weights / weights.sum(axis=-1, keepdims=True))


def _along(solid: ImplicitHand, finger: int, points: Array, distance: Array) -> Array:
    """Return convex weights (N, 4) of the palm and the phalanges of one finger at points (N, 3)."""
    passed = np.ones(len(points))
    shares = np.empty((len(points), 4))
    before = np.array([0.0, 1.0, 0.0])
    for k in range(3):
        T, radius = solid.bones[body_of(finger, k)], solid.shape.radii[finger, k]
        # The joint's plane halves the angle of its bones; points off the finger are further behind.
        normal = before + T[:3, 1]
        beyond = (points - T[:3, 3]) @ (normal / np.linalg.norm(normal))
        if k == 0:
            beyond = beyond - np.maximum(distance, 0)
        here = passed * _step(beyond / (_BLEND[k] * radius))
        shares[:, k] = passed - here
        passed = here
        before = T[:3, 1]
    shares[:, 3] = passed
    return shares


def _step(x: Array) -> Array:
    """Return a smooth step from 0 at x = -1 to 1 at x = 1."""
    t = np.clip((x + 1) / 2, 0, 1)
    return t * t * (3 - 2 * t)

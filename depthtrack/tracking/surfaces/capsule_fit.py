"""Tapered capsules that stand for a hand's skin: one for each phalanx, and a few for what moves with the palm.

They are fitted to the skin itself, so that a tracker that uses them is not misled by a palm of another outline.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from depthtrack.geometry.capsules import capsule_distance
from depthtrack.hand.kinematics import HandModel, body_of
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.types import Array, Index

_POINTS = 240
"""About how many vertices a capsule is fitted to."""
_ROUNDS = 6
"""How often the palm's vertices are shared out anew among its capsules."""
_NEAR = 0.012
"""Metres that an end may move from where it is first put, twice as far as a radius may change."""
_SOFT = 5e-4
"""Metres from which on a vertex counts less: webs and folds are no capsules."""


class Capsules(NamedTuple):
    """Tapered capsules: the `body` (K,) each is fixed to; `start` (K, 3) and unit `axis` (K, 3) in that body's frame,
    `length` (K,), `radius` (K,) at the start, and `taper` (K,), what the radius loses along the axis. Metres."""

    body: Index
    start: Array
    axis: Array
    length: Array
    radius: Array
    taper: Array


@lru_cache(maxsize=8)
def fitted_capsules(shape: HandShape) -> Capsules:
    """The capsules of a hand; fitted once for each shape (about a second), then remembered."""
    skin = Skin.of(shape)
    mover = skin.weights.argmax(axis=1)
    bodies: list[int] = []
    ends: list[Array] = []
    for body in range(16):
        T = skin.T_body_rest[body]
        points = skin.rest[mover == body] @ T[:3, :3].T + T[:3, 3]
        first = _palm(shape) if body == 0 else [_phalanx(shape, body)]
        fitted = _fit(first, points, shape.scale)
        bodies += [body] * len(fitted)
        ends += fitted
    table = np.stack(ends)
    axis = table[:, 3:6] - table[:, :3]
    length = np.linalg.norm(axis, axis=1)
    return Capsules(
        np.array(bodies),
        np.ascontiguousarray(table[:, :3]),
        axis / length[:, None],
        length,
        table[:, 6].copy(),
        _taper(table[:, 6] - table[:, 7], length),
    )


def distance(ends: Array, points: Array) -> Array:
    """Return the signed distance (N,), metres, of points (N, 3) to a capsule (8,): start, end and both radii."""
    axis = ends[3:6] - ends[:3]
    length = float(np.linalg.norm(axis))
    taper = float(_taper(np.array(ends[6] - ends[7]), np.array(length)))
    offset = points - ends[:3]
    along = offset @ axis / length
    across = np.sqrt(np.maximum(np.einsum("ni,ni->n", offset, offset) - along**2, 0))
    return capsule_distance(along, across, ends[6], taper, length)


def _taper(lost: Array, length: Array) -> Array:
    # A ball that swallows the next one would leave no cone between them.
    return np.clip(lost / np.maximum(length, 1e-6), -0.95, 0.95)


def _fit(capsules: list[Array], points: Array, scale: float) -> list[Array]:
    """Fit capsules to the points nearest to each, in turn."""
    # Ends that no vertex holds would wander off.
    near = np.concatenate([np.full(6, _NEAR), np.full(2, _NEAR / 2)]) * scale
    bounds = [(np.maximum(ends - near, np.repeat([-1, 1e-4], [6, 2])), ends + near) for ends in capsules]
    for _ in range(_ROUNDS if len(capsules) > 1 else 1):
        nearest = np.argmin([distance(ends, points) for ends in capsules], axis=0)
        for k, ends in enumerate(capsules):
            mine = points[nearest == k]
            if len(mine) >= len(ends):
                mine = mine[:: max(1, len(mine) // _POINTS)]
                fitted = least_squares(
                    distance, ends, args=(mine,), bounds=bounds[k], loss="soft_l1", f_scale=_SOFT, max_nfev=20
                )
                capsules[k] = fitted.x
    return capsules


def _phalanx(shape: HandShape, body: int) -> Array:
    """A bone of the primitive model, to begin with."""
    finger, k = divmod(body - 1, 3)
    r0, r1 = shape.radii[finger, k : k + 2]
    length = shape.lengths[finger, k] - (r1 if k == 2 else 0)
    return np.array([0, 0, 0, 0, max(length, 1e-3), 0, r0, r1]) * shape.scale


def _palm(shape: HandShape) -> list[Array]:
    """The metacarpals from wrist to knuckles, and the muscles towards the thumb and below the little finger."""
    model = HandModel(shape)
    bases, wrist = model.base_transforms[:, :3, 3], shape.wrist
    thick, radii = shape.palm_thickness / 2 * shape.scale, shape.radii[:, 0] * shape.scale
    capsules = [
        np.concatenate([wrist + 0.2 * (bases[finger] - wrist), bases[finger], [1.2 * thick, radii[finger]]])
        for finger in range(1, 5)
    ]
    thumb, little = bases[0], bases[body_of(4, 0) // 3]
    heel = wrist + 0.3 * (little - wrist) + np.array([0, 0, 0.3 * thick])
    ball = wrist + 0.2 * (thumb - wrist) + np.array([0, 0, 0.5 * thick])
    capsules.append(np.concatenate([ball, thumb + 0.4 * (bases[1] - thumb), [thick, 0.8 * thick]]))
    capsules.append(np.concatenate([heel, wrist + 0.8 * (little - wrist), [thick, 0.8 * thick]]))
    return capsules

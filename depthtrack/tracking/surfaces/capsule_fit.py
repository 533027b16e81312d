"""Fit of tapered capsules to the skin of a hand: one per phalanx, and six for the palm.

The capsules are fitted to the skin mesh, since the palm of the primitive model has another outline.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from depthtrack.geometry.capsules import capsule_distance
from depthtrack.hand.kinematics import HandModel, body_of
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.types import Array, Index

_POINTS = 240
"""Approximate number of vertices that a capsule is fitted to."""
_ROUNDS = 6
"""Number of iterations that assign the vertices of the palm to its capsules."""
_NEAR = 0.012
"""Metres, largest motion of an end from its initial position; a radius changes at most half as much."""
_SOFT = 5e-4
"""Metres, scale of the robust kernel: vertices of webs and folds are outliers."""


class Capsules(NamedTuple):
    """Tapered capsules, each fixed to a body.

    body: (K,) body that moves the capsule.
    start: (K, 3) start of the axis, metres, frame of the body.
    axis: (K, 3) unit direction, frame of the body.
    length: (K,) metres.
    radius: (K,) radius at the start, metres.
    taper: (K,) decrease of the radius per length.
    """

    body: Index
    start: Array
    axis: Array
    length: Array
    radius: Array
    taper: Array


@lru_cache(maxsize=8)
def fitted_capsules(shape: HandShape) -> Capsules:
    """Return the capsules of a hand.

    The fit takes about a second, and its result is cached.
    """
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
    """Return the signed distances (N,), metres, of points to one capsule.

    ends: (8,) start, end and both radii, metres.
    points: (N, 3) metres, in the frame of `ends`.
    """
    axis = ends[3:6] - ends[:3]
    length = float(np.linalg.norm(axis))
    taper = float(_taper(np.array(ends[6] - ends[7]), np.array(length)))
    offset = points - ends[:3]
    along = offset @ axis / length
    across = np.sqrt(np.maximum(np.einsum("ni,ni->n", offset, offset) - along**2, 0))
    return capsule_distance(along, across, ends[6], taper, length)


def _taper(lost: Array, length: Array) -> Array:
    # There is no cone between two balls if one contains the other.
    return np.clip(lost / np.maximum(length, 1e-6), -0.95, 0.95)


def _fit(capsules: list[Array], points: Array, scale: float) -> list[Array]:
    """Return capsules (8,) after alternating assignments of points (N, 3) and fits."""
    from scipy.optimize import least_squares  # a tenth of a second, for rigs alone

    # The bounds hold ends that no vertex determines.
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
    """Return the initial capsule (8,) of a phalanx: the bone of the primitive model."""
    finger, k = divmod(body - 1, 3)
    r0, r1 = shape.radii[finger, k : k + 2]
    length = shape.lengths[finger, k] - (r1 if k == 2 else 0)
    return np.array([0, 0, 0, 0, max(length, 1e-3), 0, r0, r1]) * shape.scale


def _palm(shape: HandShape) -> list[Array]:
    """Return the initial capsules (8,) of the palm: four metacarpals and two muscles."""
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

"""Residuals of one view between hand and observation, linearised by pose and sizes.

Observed points have residuals along normals to the nearest visible skin. The outline of the visible skin has residuals
to that of the observed silhouette: inwards for skin outside it (Tagliasacchi et al., "Robust articulated-ICP for
real-time hand tracking", SGP 2015, Sec. 4), outwards for skin inside it. The inward ones alone would accept a hand that
is too small, and depth alone determines neither breadth nor length of a finger.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_erosion, distance_transform_edt
from scipy.spatial import cKDTree

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BODY_COUNT
from depthtrack.hand.kinematics import HandModel, body_of
from depthtrack.hand.pose import TANGENT_SIZE
from depthtrack.hand.shape import HandShape
from depthtrack.hand.size_parameters import COUNT, motion_of
from depthtrack.hand.skin.mesh import Skin
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.rendering.triangles import rasterise
from depthtrack.segmentation.observation import Observation
from depthtrack.solver.robust import geman_mcclure, symmetric_direction
from depthtrack.types import Array, Index, Mask

_POINTS = 1200
"""Approximate number of points of a view that are used."""
_REACH, _AGREEMENT = 0.04, 0.3
"""Metres and cosine between normals: limits of a correspondence."""
_WRIST_ROOM = 0.012
"""Metres from the wrist without residuals: the position of the cut between hand and forearm is uncertain."""
PATCH = 0.010
"""Metres: errors of sensor and model are alike within a patch of this side, which counts as one measurement."""


class CalibrationView:
    """Observation of one frame, prepared for many fits."""

    def __init__(self, observation: Observation) -> None:
        self.observation = observation
        every = max(1, round(observation.reading_count / _POINTS))
        self.points, self.normals = observation.subsampled_cloud(every)
        self.beyond = _beyond(observation.silhouette)
        """(h, w) signed distance to the silhouette in pixels, negative inside."""
        slope = np.stack([np.gradient(self.beyond, axis=axis) for axis in (0, 1)])
        self.outward = slope / np.maximum(np.linalg.norm(slope, axis=0), 1e-9)
        """(2, h, w) unit, by row and column: away from the silhouette."""
        pixel = float(observation.centre[2]) / observation.camera.fx
        self.patches = max(1.0, np.count_nonzero(observation.depth) * pixel**2 / PATCH**2)
        """Number of independent measurements in the view."""


class PosedSkin:
    """Skin of a hand of given sizes, rendered in the views.

    By default it is the skin of the average hand, stretched along and across its bones, which is fast. `exact` builds
    the skin of the sizes.

    Raises:
        InputError: if `exact` and the sizes give no single solid hand.
    """

    def __init__(self, shape: HandShape, exact: bool = False) -> None:
        average = HandShape(side=shape.side)
        self.model, self._skin = HandModel(shape), Skin.of(shape if exact else average)
        self._stretch = np.tile(np.eye(4), (BODY_COUNT, 1, 1)) if exact else _stretches(shape, average)
        self.wrist = shape.wrist[1] + _WRIST_ROOM

    def seen(self, view: CalibrationView, pose: Array) -> RenderedSurface:
        """Return the skin in a pose (27,), rendered with the camera of the view."""
        skin = self._skin
        vertices = skin.vertices(self.model.transforms(pose) @ self._stretch)
        return rasterise(view.observation.camera, vertices, skin.faces, skin.normals(vertices), skin.face_bodies)

    def is_hand(self, pose: Array, points: Array) -> Mask:
        """Return whether points lie on the finger side of the wrist.

        points: (N, 3) metres, camera frame.
        """
        T = self.model.transforms(pose)[0]
        return np.asarray((points - T[:3, 3]) @ T[:3, 1] > self.wrist)


@dataclass(frozen=True)
class Evidence:
    """Normal equations of a view, for pose and sizes (26 + 35).

    H: (61, 61) weighted sum of a a^T, with gradients a (61,).
    g: (61,) weighted sum of a e, with residuals e (m).
    count: number of residuals.
    distance: median distance of the observed points to the skin, m, infinite if there are none.
    """

    H: Array
    g: Array
    count: int
    distance: float


@dataclass(frozen=True)
class _Residuals:
    """Residuals of skin points along directions.

    bodies: (N,).
    x: (N, 3) metres, camera frame.
    directions: (N, 3).
    errors: (N,) m, signed.
    distances: (N,) m, from which the robust weights follow.
    """

    bodies: Index
    x: Array
    directions: Array
    errors: Array
    distances: Array


def linearise(view: CalibrationView, skin: PosedSkin, pose: Array, kernel_scale: float) -> Evidence:
    """Return the evidence of a view for a pose (27,).

    kernel_scale: m, scale of the Geman-McClure kernel.
    """
    surface = skin.seen(view, pose)
    row, column = np.nonzero(surface.depth)
    if len(row) == 0:
        return Evidence(np.zeros((TANGENT_SIZE + COUNT,) * 2), np.zeros(TANGENT_SIZE + COUNT), 0, np.inf)
    x = view.observation.camera.unproject(np.stack([column, row], axis=-1), surface.depth[row, column])
    bodies, normals = surface.label[row, column].astype(np.int64), surface.normal[row, column]
    places = np.full(surface.depth.shape, -1)
    places[row, column] = np.arange(len(row))
    on_surface = _surface_residuals(view, skin, pose, bodies, x, normals)
    parts = [on_surface, _outline_residuals(view, skin, pose, bodies, x, places)]
    a = np.concatenate([_gradients(skin.model, pose, part) for part in parts])
    errors, distances = (np.concatenate([getattr(part, name) for part in parts]) for name in ("errors", "distances"))
    weights = geman_mcclure(distances**2, kernel_scale)
    found = on_surface.distances
    H, g = weighted_sums(a, weights, errors)
    return Evidence(H, g, len(errors), float(np.median(found)) if len(found) else np.inf)


@compiled(nogil=True)
def weighted_sums(a: Array, weights: Array, errors: Array) -> tuple[Array, Array]:
    """Return the weighted sums H (n, n) of a a^T and g (n,) of a e.

    A library's matrix product of this size waits for its threads: 47 ms in place of 1 ms on busy cores.

    a: (N, n) gradients.
    """
    n = a.shape[1]
    H, g = np.zeros((n, n)), np.zeros(n)
    for k in range(len(a)):
        row, weight = a[k], weights[k]
        for i in range(n):
            share = weight * row[i]
            if share != 0.0:
                g[i] += share * errors[k]
                for j in range(i, n):
                    H[i, j] += share * row[j]
    for i in range(n):
        for j in range(i):
            H[i, j] = H[j, i]
    return H, g


def _stretches(shape: HandShape, average: HandShape) -> Array:
    """Return the stretches (16, 4, 4), body frames, from the average hand to these sizes."""
    S = np.tile(np.eye(4), (BODY_COUNT, 1, 1))
    sizes = ("palm_breadth", "palm_length", "palm_thickness")
    S[0, [0, 1, 2], [0, 1, 2]] = [getattr(shape, size) / getattr(average, size) for size in sizes]
    longer, wider = shape.lengths / average.lengths, (shape.radii / average.radii).mean(axis=1)
    for finger in range(5):
        for phalanx in range(3):
            factors = wider[finger], longer[finger, phalanx], wider[finger]
            S[body_of(finger, phalanx), [0, 1, 2], [0, 1, 2]] = factors
    S[:, :3] *= shape.scale
    return S


def _surface_residuals(
    view: CalibrationView, skin: PosedSkin, pose: Array, bodies: Index, x: Array, normals: Array
) -> _Residuals:
    """Return the symmetric residuals of points and the nearest visible skin."""
    distance, nearest = map(np.asarray, cKDTree(x).query(view.points, distance_upper_bound=_REACH))
    found = np.flatnonzero(np.isfinite(distance))
    found = found[skin.is_hand(pose, view.points[found])]
    found = found[np.sum(normals[nearest[found]] * view.normals[found], axis=1) > _AGREEMENT]
    k = nearest[found]
    directions = np.stack(symmetric_direction(*normals[k].T, *view.normals[found].T), axis=1)
    errors = np.sum(directions * (x[k] - view.points[found]), axis=1)
    return _Residuals(bodies[k], x[k], directions, errors, distance[found])


def _outline_residuals(
    view: CalibrationView, skin: PosedSkin, pose: Array, bodies: Index, x: Array, places: Index
) -> _Residuals:
    """Return the residuals from the outline of the visible skin to that of the silhouette.

    places: (h, w) index into `x`, -1 without skin.
    """
    inner = binary_erosion(places >= 0, border_value=1)
    row, column = np.nonzero((places >= 0) & ~inner)
    k = places[row, column]
    across = view.outward[:, row, column]
    # The outline runs along the outer side of its pixels.
    pixels = view.beyond[row, column] + 0.5
    kept = skin.is_hand(pose, x[k]) & (np.abs(across).sum(axis=0) > 0)
    k, pixels, across = k[kept], pixels[kept], across[:, kept]
    z = x[k, 2]
    directions = np.stack([across[1], across[0], -(across[1] * x[k, 0] + across[0] * x[k, 1]) / z], axis=-1)
    errors = pixels * z / view.observation.camera.fx
    return _Residuals(bodies[k], x[k], directions, errors, np.abs(errors))


def _gradients(model: HandModel, pose: Array, residuals: _Residuals) -> Array:
    """Return the gradients (N, 26 + 35) of the errors by pose and sizes."""
    bodies, x, n = residuals.bodies, residuals.x, residuals.directions
    a = np.empty((len(x), TANGENT_SIZE + COUNT))
    a[:, :TANGENT_SIZE] = np.einsum("ni,nij->nj", n, model.point_jacobian(pose, bodies, x))
    a[:, TANGENT_SIZE:] = np.einsum("ni,nij->nj", n, motion_of(model, pose, bodies, x))
    return a


def _beyond(mask: Mask) -> Array:
    """Return the signed distance (h, w) to the outline of the mask in pixels, negative inside."""
    outside, inside = (np.asarray(distance_transform_edt(part), dtype=np.float64) for part in (~mask, mask))
    return np.where(mask, 0.5 - inside, outside - 0.5)

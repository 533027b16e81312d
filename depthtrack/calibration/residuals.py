"""Residuals of one view between hand and observation, linearised by pose and sizes.

Observed points have residuals along normals to the nearest visible skin. The outline of the visible skin has residuals
to that of the observed silhouette: inwards for skin outside it (Tagliasacchi et al., "Robust articulated-ICP for
real-time hand tracking", SGP 2015, Sec. 4), outwards for skin inside it. The inward ones alone would accept a hand that
is too small, and depth alone determines neither breadth nor length of a finger.
"""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from depthtrack.calibration.outline_and_surface import SeenSkin, SeenView, outline_residuals, surface_residuals
from depthtrack.calibration.posed_mesh import PosableMesh, posed_mesh
from depthtrack.calibration.size_equations import PARAMETERS, SizedHand, add_normal_equations, mirror_upper
from depthtrack.hand.compiled_kinematics import BODY_COUNT
from depthtrack.hand.displacement_grid import NODES
from depthtrack.hand.kinematics import HandModel, body_of
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.rendering.triangles import rasterise
from depthtrack.segmentation.observation import Observation
from depthtrack.types import Array, Mask

_POINTS = 1200
"""Approximate number of points of a view that are used."""
_WRIST_ROOM = 0.012
"""Metres from the wrist without residuals: the position of the cut between hand and forearm is uncertain."""
PATCH = 0.010
"""Metres: errors of sensor and model are alike within a patch of this side, which counts as one measurement."""


class CalibrationView:
    """Observation of one frame, prepared for many fits."""

    def __init__(self, observation: Observation) -> None:
        self.observation = observation
        every = max(1, round(observation.reading_count / _POINTS))
        points, normals = observation.subsampled_cloud(every)
        beyond = _beyond(observation.silhouette)
        slope = np.stack([np.gradient(beyond, axis=axis) for axis in (0, 1)])
        self.seen = SeenView(points, normals, beyond, slope / np.maximum(np.linalg.norm(slope, axis=0), 1e-9))
        pixel = float(observation.centre[2]) / observation.camera.fx
        self.patches = max(1.0, np.count_nonzero(observation.depth) * pixel**2 / PATCH**2)
        """Number of independent measurements in the view."""


class PosedSkin:
    """Skin of a hand of given sizes, rendered in the views.

    It is the skin of another hand, the average one by default, stretched along and across its bones. That is fast.

    Raises:
        InputError: if the sizes of the other hand give no single solid hand.
    """

    def __init__(self, shape: HandShape, built: HandShape | None = None) -> None:
        built = built or HandShape(side=shape.side)
        self.model, self._skin = HandModel(shape), Skin.of(built)
        self._mesh, self._stretch = _mesh_of(self._skin), stretches(shape, built)
        self.wrist = shape.wrist[1] + _WRIST_ROOM

    def seen(self, view: CalibrationView, pose: Array) -> RenderedSurface:
        """Return the skin in a pose (27,), rendered with the camera of the view."""
        skin = self._skin
        vertices, normals = posed_mesh(self._mesh, self.model.transforms(pose) @ self._stretch @ skin.T_body_rest)
        return rasterise(
            view.observation.camera,
            vertices,
            self._mesh.faces,
            normals,
            skin.face_bodies,
            closed=skin.shape.rig is None,
        )


@lru_cache(maxsize=4)
def _mesh_of(skin: Skin) -> PosableMesh:
    """Return the mesh of a skin."""
    return PosableMesh.of(skin)


@dataclass(frozen=True)
class Evidence:
    """Normal equations of a view for n parameters.

    They are pose, sizes and, if wanted, the displacement of the skin.

    H: (n, n) weighted sum of a a^T, with gradients a (n,).
    g: (n,) weighted sum of a e, with residuals e (m).
    count: number of residuals.
    distance: median distance of the observed points to the skin, m, infinite if there are none.
    """

    H: Array
    g: Array
    count: int
    distance: float


def linearise(
    view: CalibrationView, pose: Array, skin: PosedSkin, kernel_scale: float, displaced: bool = False
) -> Evidence:
    """Return the evidence of a view for a pose (27,).

    kernel_scale: m, scale of the Geman-McClure kernel.
    displaced: for the displacement of the skin too.
    """
    surface, camera = skin.seen(view, pose), view.observation.camera
    hand = SizedHand.at(skin.model, pose)
    seen = SeenSkin(surface.depth, surface.label, surface.normal, (camera.fx, camera.fy, camera.cx, camera.cy))
    on_surface = surface_residuals(view.seen, seen, hand.bodies.T[0], skin.wrist)
    on_outline = outline_residuals(view.seen, seen, hand.bodies.T[0], skin.wrist)
    n = PARAMETERS + (NODES if displaced else 0)
    H, g = np.zeros((n, n)), np.zeros(n)
    for residuals in (on_surface, on_outline):
        add_normal_equations(hand, residuals, kernel_scale, H, g)
    mirror_upper(H)
    found = on_surface.distances
    count = len(found) + len(on_outline.distances)
    return Evidence(H, g, count, float(np.median(found)) if len(found) else np.inf)


def stretches(shape: HandShape, other: HandShape) -> Array:
    """Return the stretches (16, 4, 4), body frames, from another hand to these sizes."""
    S = np.tile(np.eye(4), (BODY_COUNT, 1, 1))
    sizes = ("palm_breadth", "palm_length", "palm_thickness")
    S[0, [0, 1, 2], [0, 1, 2]] = [getattr(shape, size) / getattr(other, size) for size in sizes]
    longer, wider = shape.lengths / other.lengths, (shape.radii / other.radii).mean(axis=1)
    for finger in range(5):
        for phalanx in range(3):
            factors = wider[finger], longer[finger, phalanx], wider[finger]
            S[body_of(finger, phalanx), [0, 1, 2], [0, 1, 2]] = factors
    S[:, :3] *= shape.scale / other.scale
    return S


def _beyond(mask: Mask) -> Array:
    """Return the signed distance (h, w) to the outline of the mask in pixels, negative inside."""
    parts = (part.astype(np.uint8) for part in (~mask, mask))
    found = (cv2.distanceTransform(part, cv2.DIST_L2, cv2.DIST_MASK_PRECISE).astype(np.float64) for part in parts)
    # OpenCV's last bit depends on the place in memory. Squares of distances are whole numbers.
    outside, inside = (np.sqrt(np.rint(each * each)) for each in found)
    return np.where(mask, 0.5 - inside, outside - 0.5)

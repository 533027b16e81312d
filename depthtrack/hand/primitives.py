"""The hand of 37 spheres and cylinders of Oikonomidis et al. 2011, Sec. 2.2.

The palm has one elliptic cylinder and two ellipsoid caps. A finger has three cones and four spheres. The thumb has an
ellipsoid, two cones and three spheres. A unit sphere is |u| <= 1; a unit cylinder is ux^2 + uy^2 <= 1, 0 <= uz <= 1.
The 4x4 matrix T_body_unit is affine for spheres, ellipsoids and cylinders, and projective for cones:
the image of a cylinder under a homography is a cone, so two shapes suffice, as on the GPU (Sec. 2.5).

The paper gives no sizes. Fingers have the radii of `HandShape`. The proportions of the palm and of the thumb's
ellipsoid are fitted to the skin, so that fits of both surfaces place the joints alike.
"""

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from depthtrack.hand.kinematics import body_of
from depthtrack.hand.pose import FINGERS
from depthtrack.hand.shape import HandShape
from depthtrack.types import Array, Index

SPHERE, CYLINDER = 0, 1
PRIMITIVE_COUNT = 37


class Proportions(NamedTuple):
    """Positions and sizes of palm and thumb as shares of the sizes of `HandShape`.

    Centres are x, y, z from the middle of the knuckles, in halves of the palm's breadth and thickness and in its
    length.
    The thumb's centre is from its saddle joint, in radii and metacarpal lengths.

    cylinder: x, z of its axis; half breadth, half thickness; first and last y.
    knuckle_cap: centre and half axes of the ellipsoid that closes the cylinder.
    wrist_cap: the same, its half axes across in halves of the wrist's breadth and thickness.
    thumb: centre and half axes of the ellipsoid, lengthened by half the radius of its far joint.

    Source: `tools/fit_primitives.py`.
    """

    cylinder: tuple[float, float, float, float, float, float]
    wrist_cap: tuple[float, float, float, float, float, float]
    knuckle_cap: tuple[float, float, float, float, float, float]
    thumb: tuple[float, float, float, float, float, float]


FITTED = Proportions(
    cylinder=(0.029, 0.055, 0.956, 0.955, -0.252, 0.331),
    wrist_cap=(0.073, -0.263, 0.098, 1.384, 0.28, 0.999),
    knuckle_cap=(0.036, 0.324, 0.064, 1.105, 0.214, 0.962),
    thumb=(-0.147, 0.364, 0.073, 1.147, 0.758, 1.07),
)


@dataclass(frozen=True)
class Primitives:
    """Unit primitives, each fixed to a body.

    kinds: (N,) SPHERE or CYLINDER.
    bodies: (N,) 0 to 15.
    T_body_unit: (N, 4, 4) from the unit frame to the body frame, metres; projective for cones.
    names: N unique names.
    """

    kinds: Index
    bodies: Index
    T_body_unit: Array
    names: tuple[str, ...]

    @classmethod
    def of(cls, shape: HandShape, proportions: Proportions = FITTED) -> Self:
        """Return the 37 primitives of a hand."""
        parts = _palm(shape, proportions)
        for finger in range(5):
            parts += _thumb(shape, proportions) if finger == 0 else _finger(shape, finger)
        names, kinds, bodies, matrices = zip(*parts, strict=True)
        flip = np.diag([shape.mirror, 1, 1, 1])
        scale = np.diag([shape.scale, shape.scale, shape.scale, 1])
        return cls(np.array(kinds), np.array(bodies), flip @ scale @ np.stack(matrices) @ flip, names)

    def transforms(self, transforms: Array) -> Array:
        """Return T_camera_unit (..., N, 4, 4), metres, of the primitives.

        transforms: (..., 16, 4, 4) T_camera_body, metres.
        """
        return transforms[..., self.bodies, :, :] @ self.T_body_unit


_Part = tuple[str, int, int, Array]


def _palm(shape: HandShape, proportions: Proportions) -> list[_Part]:
    middle = np.array([(shape.bases[1:, 0].max() + shape.bases[1:, 0].min()) / 2, 0, 0])
    palm = np.array([shape.palm_breadth / 2, shape.palm_length, shape.palm_thickness / 2])
    wrist = np.array([shape.wrist_breadth / 2, shape.palm_length, shape.wrist_thickness / 2])
    x, z, breadth, thickness, first, last = proportions.cylinder
    unit = cone((0, 0, 0), (last - first) * palm[1], 1.0, 1.0)
    cylinder = np.diag([breadth * palm[0], 1, thickness * palm[2], 1]) @ unit
    cylinder[:3, 3] = middle + palm * (x, first, z)
    return [
        ("palm_cylinder", CYLINDER, 0, cylinder),
        ("palm_wrist_cap", SPHERE, 0, _ellipsoid(middle, palm, wrist, proportions.wrist_cap)),
        ("palm_knuckle_cap", SPHERE, 0, _ellipsoid(middle, palm, palm, proportions.knuckle_cap)),
    ]


def _ellipsoid(origin: Array, unit: Array, across: Array, shares: tuple[float, ...]) -> Array:
    """Return the transform (4, 4), metres, of an ellipsoid.

    origin: (3,) metres.
    unit, across: (3,) metres, units of the centre and of the half axes.
    shares: (6,) centre from the origin, and half axes.
    """
    T = np.diag([*(across * shares[3:]), 1.0])
    T[:3, 3] = origin + unit * shares[:3]
    return T


def _finger(shape: HandShape, finger: int) -> list[_Part]:
    name, lengths, radii = FINGERS[finger], _bone_lengths(shape, finger), shape.radii[finger]
    parts: list[_Part] = []
    for k in range(3):
        body = body_of(finger, k)
        parts.append((f"{name}_sphere_{k}", SPHERE, body, sphere(0.0, radii[k])))
        parts.append((f"{name}_cone_{k}", CYLINDER, body, cone((0, 0, 0), lengths[k], radii[k], radii[k + 1])))
    parts.append((f"{name}_sphere_3", SPHERE, body_of(finger, 2), sphere(lengths[2], radii[3])))
    return parts


def _thumb(shape: HandShape, proportions: Proportions) -> list[_Part]:
    lengths, radii = _bone_lengths(shape, 0), shape.radii[0]
    unit = np.array([radii[0], lengths[0], radii[0]])
    metacarpal = _ellipsoid(np.zeros(3), unit, unit, proportions.thumb)
    metacarpal[1, 1] += 0.5 * radii[1]
    parts: list[_Part] = [("thumb_ellipsoid", SPHERE, body_of(0, 0), metacarpal)]
    for k in (1, 2):
        body = body_of(0, k)
        parts.append((f"thumb_sphere_{k}", SPHERE, body, sphere(0.0, radii[k])))
        parts.append((f"thumb_cone_{k}", CYLINDER, body, cone((0, 0, 0), lengths[k], radii[k], radii[k + 1])))
    parts.append(("thumb_sphere_3", SPHERE, body_of(0, 2), sphere(lengths[2], radii[3])))
    return parts


def _bone_lengths(shape: HandShape, finger: int) -> Array:
    """Return the distances (3,) between sphere centres, metres; the last sphere ends at the tip."""
    lengths = shape.lengths[finger].copy()
    lengths[2] = max(lengths[2] - shape.radii[finger, 3], 1e-4)
    return lengths


def sphere(y: float, radius: float) -> Array:
    """Return the transform (4, 4), metres, of the unit sphere to a ball at (0, y, 0)."""
    return ellipsoid((0.0, y, 0.0), (radius, radius, radius))


def ellipsoid(centre: tuple[float, float, float], radii: tuple[float, float, float]) -> Array:
    """Return the transform (4, 4), metres, of the unit sphere to an axis-aligned ellipsoid."""
    T = np.diag([*radii, 1.0])
    T[:3, 3] = centre
    return T


def cone(start: tuple[float, float, float], length: float, radius_start: float, radius_end: float) -> Array:
    """Return the transform (4, 4), metres, of the unit cylinder to a cone frustum along +y.

    With w = 1 + k uz and k = radius_start / radius_end - 1, the radius radius_start / w is linear in the
    distance length (1 + k) uz / w along the axis.
    """
    k = radius_start / radius_end - 1
    T = np.zeros((4, 4))
    T[0, 0] = radius_start
    T[1, 2] = length * (1 + k)
    T[2, 1] = -radius_start
    T[3] = [0, 0, k, 1]
    shift = np.eye(4)
    shift[:3, 3] = start
    return shift @ T

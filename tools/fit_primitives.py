"""Fit the proportions of palm and thumb in `depthtrack.hand.primitives` to the skin.

Usage: fit_primitives.py [--hands N] [--seed N]

The skins are those of the average hand and of hands with random sizes, in typical and in random postures. The squared
distances of the vertices of palm and thumb from the union of the primitives are minimised, with a robust kernel. The
caps must cover the open ends of the palm's cylinder. Cap and thumb end at the wrist, where segmentation cuts the arm.
Printed are the fitted proportions, and the distances of these hands and of others before and after the fit.
"""

import argparse
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

# The checkout that this script lies in, whatever is installed.
sys.path.insert(0, str(Path(__file__).parents[1]))

from depthtrack.errors import InputError
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.primitives import SPHERE, Primitives, Proportions
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.types import Array

PAPER = Proportions(
    cylinder=(0.0, 0.0, 1.0, 1.0, -0.36, 0.42),
    wrist_cap=(0.0, -0.36, 0.0, 1.39, 0.14, 0.74),
    knuckle_cap=(0.0, 0.42, 0.0, 1.0, 0.13, 1.0),
    thumb=(0.0, 0.5, 0.0, 1.0, 0.5, 0.9),
)
"""A palm symmetric about the middle of the knuckles, to compare with."""
TAPERED = PAPER._replace(
    cylinder=(0.0, 0.0, 1.0, 1.0, -0.12, 0.36),
    wrist_cap=(0.0, -0.12, 0.0, 1.39, 0.4, 0.74),
    knuckle_cap=(0.0, 0.36, 0.0, 1.0, 0.19, 1.0),
)
"""Start of the fit: the same with an ellipsoid that narrows towards the wrist."""
UNIT = 0.1
"""Change of a proportion that the solver sees as one."""
STEP = 0.02
"""Step of the finite differences, in units."""
SOFT = 1.5
"""Millimetres, scale of the robust kernel."""
FAR = 20.0
"""Millimetres, largest distance that counts."""
RIM = 16
"""Points of each rim of the cylinder."""
ENDING = ("palm_wrist_cap", "thumb_ellipsoid")
"""Ellipsoids that reach the wrist."""
OVERLAP = 0.004
"""Metres: largest part of one beyond the wrist."""
HARD = 100.0
"""Weight of distances that must vanish, against 1 for that of a vertex."""
RANDOM_POSTURES = 2
"""Number of random postures for each hand, beside the typical ones."""


class Posed(NamedTuple):
    """A hand in a posture: sizes, T_palm_body (16, 4, 4), skin vertices (N, 3), metres."""

    shape: HandShape
    transforms: Array
    vertices: Array


def random_shape(rng: np.random.Generator) -> HandShape:
    """Return sizes that differ from the average about as much as those of people."""
    average = HandShape()
    palm = ("palm_breadth", "palm_length", "palm_thickness", "wrist_breadth", "wrist_thickness")
    while True:
        shape = average.with_(
            lengths=average.lengths * rng.uniform(0.9, 1.1, (5, 1)),
            radii=average.radii * rng.uniform(0.85, 1.15),
            bases=average.bases * rng.uniform(0.95, 1.1, 3),
            **{name: getattr(average, name) * rng.uniform(0.9, 1.12) for name in palm},
        )
        try:
            Skin.of(shape)
        except InputError:
            continue
        return shape


def postures(shape: HandShape, rng: np.random.Generator) -> list[Posed]:
    """Return a hand in typical and random postures, with a quarter of its palm."""
    skin, model = Skin.of(shape), HandModel(shape)
    pick = np.flatnonzero(skin.weights[:, :2].sum(axis=1) > 0.35)[::4]
    middle = [LOWER + (UPPER - LOWER) * rng.uniform(0.2, 0.8, 20) for _ in range(RANDOM_POSTURES)]
    transforms = [
        model.transforms(make_pose(np.zeros(3), (1, 0, 0, 0), angles)) for angles in (*POSTURES.values(), *middle)
    ]
    return [Posed(shape, T, skin.vertices(T)[pick]) for T in transforms]


def distances(proportions: Proportions, hands: list[Posed]) -> Array:
    """Return the signed distances (N,), mm, of all vertices from the primitives."""
    found = []
    for hand in hands:
        primitives = Primitives.of(hand.shape, proportions)
        placed = zip(primitives.kinds, primitives.transforms(hand.transforms), strict=True)
        found.append(np.min([distance(int(kind), T, hand.vertices) for kind, T in placed], axis=0))
    return np.asarray(np.clip(1e3 * np.concatenate(found), -FAR, FAR))


def robust(r: Array) -> Array:
    """Return residuals with the soft L1 kernel of `r` (N,), mm, as their squares."""
    return np.asarray(np.sign(r) * SOFT * np.sqrt(2 * (np.sqrt(1 + (r / SOFT) ** 2) - 1)))


def uncovered(proportions: Proportions) -> Array:
    """Return how far (2 * RIM,), mm, the rims of the palm's cylinder leave its caps."""
    cylinder, *caps = Primitives.of(HandShape(), proportions).T_body_unit[:3]
    angle = 2 * np.pi * np.arange(RIM) / RIM
    out = []
    for cap, end in zip(caps, (0.0, 1.0), strict=True):
        unit = np.column_stack([np.cos(angle), np.sin(angle), np.full(RIM, end), np.ones(RIM)])
        out.append(np.maximum(distance(SPHERE, cap, (unit @ cylinder.T)[:, :3]), 0))
    return np.asarray(1e3 * np.concatenate(out))


def beyond_wrist(proportions: Proportions) -> float:
    """Return how far palm and thumb of a resting hand end beyond the wrist, mm."""
    primitives, model = Primitives.of(HandShape(), proportions), HandModel(HandShape())
    rest = make_pose(np.zeros(3), (1, 0, 0, 0), np.zeros(20))
    T = primitives.transforms(model.transforms(rest))[[primitives.names.index(name) for name in ENDING]]
    lowest = T[:, 1, 3] - np.linalg.norm(T[:, 1, :3], axis=1)
    return float(1e3 * np.maximum(model.wrist(rest)[1] - lowest - OVERLAP, 0).sum())


def distance(kind: int, T: Array, points: Array) -> Array:
    """Return first-order signed distances (N,), metres, of points (N, 3).

    T: (4, 4) from the unit frame to the frame of the points, possibly projective.
    """
    inverse = np.linalg.inv(T)
    h = np.column_stack([points, np.ones(len(points))]) @ inverse.T
    u, w = h[:, :3] / h[:, 3:], h[:, 3, None, None]
    J = inverse[:3, :3] / w - u[:, :, None] * inverse[3, :3] / w
    used = 3 if kind == SPHERE else 2
    radius = np.maximum(np.linalg.norm(u[:, :used], axis=1), 1e-9)
    gradient = np.einsum("ni,nij->nj", u[:, :used] / radius[:, None], J[:, :used])
    around = (radius - 1) / np.maximum(np.linalg.norm(gradient, axis=1), 1e-9)
    if kind == SPHERE:
        return around
    return np.maximum(around, np.maximum(-u[:, 2], u[:, 2] - 1) / np.linalg.norm(J[:, 2], axis=1))


def of_vector(values: Array) -> Proportions:
    """Return the proportions of a vector (24,)."""
    return Proportions._make(tuple(part.tolist()) for part in values.reshape(4, 6))


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--hands", type=int, default=3)
    arguments.add_argument("--seed", type=int, default=1)
    chosen = arguments.parse_args()
    rng = np.random.default_rng(chosen.seed)
    shapes = [HandShape(), *(random_shape(rng) for _ in range(2 * chosen.hands - 1))]
    fitted, others = (
        [posed for shape in part for posed in postures(shape, rng)]
        for part in (shapes[: chosen.hands], shapes[chosen.hands :])
    )
    start = np.array(TAPERED).ravel()

    def residuals(x: Array) -> Array:
        proportions = of_vector(start + UNIT * (x - 1))
        return np.concatenate(
            [robust(distances(proportions, fitted)), HARD * uncovered(proportions), [HARD * beyond_wrist(proportions)]]
        )

    found = least_squares(
        residuals,
        np.ones(start.size),
        diff_step=[STEP],
        max_nfev=30,
    )
    best = of_vector(np.round(start + UNIT * (found.x - 1), 3))
    print(*(f"{name}={value}," for name, value in best._asdict().items()), sep="\n")
    print(f"the caps leave {uncovered(best).max():.2f} mm of the cylinder's rims open")
    for name, hands in (("fitted hands", fitted), ("other hands", others)):
        rms = [float(np.sqrt(np.mean(distances(each, hands) ** 2))) for each in (PAPER, best)]
        print(f"{name}: root mean square distance {rms[0]:.2f} mm before, {rms[1]:.2f} mm after")


if __name__ == "__main__":
    main()

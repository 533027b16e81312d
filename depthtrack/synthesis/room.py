"""Backgrounds: a wall, or a cluttered room with a bystander and skin-coloured objects."""

import numpy as np

from depthtrack.synthesis.backdrop import Backdrop
from depthtrack.types import Array


def add_wall(backdrop: Backdrop, distance: float, rng: np.random.Generator) -> None:
    """Draw a wall 0.9 to 1.3 m behind the hand, slightly slanted.

    distance: metres from the camera to the nominal palm position.
    """
    turn = rng.uniform(-0.15, 0.15)
    centre = (0, 0, distance + rng.uniform(0.9, 1.3))
    backdrop.plane(centre, (5 * np.cos(turn), 0, 5 * np.sin(turn)), (0, 5, 0), (204, 204, 198))


def add_room(backdrop: Backdrop, distance: float, rng: np.random.Generator) -> None:
    """Draw walls, floor, furniture and a bystander 0.9 to 2.5 m behind the hand.

    Objects are placed by their normalised image coordinates (x, y) / z, so clutter fills the image of every sensor.

    distance: metres from the camera to the nominal palm position.
    """

    def at(x: float, y: float, z: float) -> Array:
        """Return a point (3,) near the ray through (x, y), about z metres behind the hand."""
        depth = distance + z + rng.uniform(-0.05, 0.05)
        return np.array([(x + rng.uniform(-0.04, 0.04)) * depth, y * depth, depth])

    def beside(point: Array, offset: list[float]) -> Array:
        return point + np.array(offset)

    def turn() -> float:
        return float(rng.uniform(-0.5, 0.5))

    side = rng.choice([-1.0, 1.0])
    back = distance + 2.5
    floor = 0.42 * back
    backdrop.plane((0, 0, back), (8, 0, 0), (0, 8, 0), (196, 198, 190))
    backdrop.plane((0, floor, back - 1), (8, 0, 0), (0, 0, 1), (110, 104, 98))
    backdrop.plane((side * 0.55 * back, 0, back - 0.9), (0, 8, 0), (0, 0, 0.9), (170, 182, 190))

    # A bystander: face and neck of another skin colour, dark hair, blue shirt.
    head = at(0.40 * side, -0.14, 1.15)
    backdrop.ellipsoid(head, (0.075, 0.112, 0.095), None)
    backdrop.ellipsoid(beside(head, [0, -0.03, 0.03]), (0.084, 0.105, 0.095), (52, 42, 38))
    backdrop.column(beside(head, [0, 0.08, 0.02]), 0.12, 0.052, None)
    backdrop.ellipsoid(beside(head, [0, 0.58, 0.06]), (0.23, 0.42, 0.13), (60, 84, 128))

    # A table with wooden and cardboard objects, whose colours are close to skin.
    table = at(-0.36 * side, 0.30, 1.2)
    backdrop.box(table, (0.9, 0.035, 0.5), turn(), (150, 116, 86))
    for x in (-0.35, 0.35):
        backdrop.box(beside(table, [x, 0.35, 0.05]), (0.05, 0.7, 0.05), 0.0, (120, 90, 64))
    backdrop.box(beside(table, [0.14, -0.10, 0.0]), (0.17, 0.16, 0.14), turn(), (198, 158, 118))
    backdrop.column(beside(table, [-0.14, -0.12, -0.05]), 0.10, 0.04, (206, 70, 52))
    backdrop.box(beside(table, [-0.3, -0.08, 0.05]), (0.12, 0.13, 0.05), turn(), (72, 120, 84))

    # A bookcase, a picture, a lamp and a plant along the walls.
    case = at(0.02 * side, 0.02, 2.2)
    backdrop.box(case, (0.8, 1.5, 0.3), 0.0, (128, 98, 72))
    for row in range(4):
        for n in range(5):
            size = (rng.uniform(0.04, 0.12), rng.uniform(0.18, 0.28), 0.06)
            colour = (int(rng.integers(40, 200)), int(rng.integers(40, 200)), int(rng.integers(60, 210)))
            backdrop.box(beside(case, [-0.3 + 0.15 * n, -0.55 + 0.37 * row, -0.17]), size, 0.0, colour)
    backdrop.box(at(-0.42 * side, -0.25, 2.4), (0.6, 0.45, 0.03), 0.0, (90, 130, 170))
    lamp = at(-0.55 * side, -0.02, 1.7)
    backdrop.ellipsoid(lamp, (0.12, 0.12, 0.12), (236, 226, 190))
    backdrop.column(lamp, 1.2, 0.015, (60, 60, 62))
    plant = at(0.52 * side, 0.22, 1.9)
    for _ in range(8):
        backdrop.ellipsoid(plant + rng.normal(0, 0.11, 3), rng.uniform(0.05, 0.11, 3), (58, 104, 52))
    backdrop.column(beside(plant, [0, 0.1, 0]), 0.3, 0.12, (152, 92, 70))

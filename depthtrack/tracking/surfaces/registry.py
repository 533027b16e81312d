"""The surfaces of a hand that points are matched to, by name."""

from depthtrack.hand.shape import HandShape
from depthtrack.rendering.backends import create_scorer
from depthtrack.solver.correspondences import Surface
from depthtrack.solver.options import SurfaceName
from depthtrack.tracking.surfaces.capsules import CapsuleSurface
from depthtrack.tracking.surfaces.points import PointSurface
from depthtrack.tracking.surfaces.primitives import primitive_points
from depthtrack.tracking.surfaces.skin import skin_points


def make_surface(name: SurfaceName, hand: HandShape, renderer: str = "raster") -> Surface:
    """Return the surface of a hand.

    renderer: backend that finds which cylinders are hidden.

    Raises:
        InputError: no skin fits the sizes of the hand.
    """
    if name == "cylinders":
        return CapsuleSurface(hand, create_scorer(renderer, hand))
    return PointSurface(skin_points(hand) if name == "skin" else primitive_points(hand))

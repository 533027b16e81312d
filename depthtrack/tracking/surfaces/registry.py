"""The surfaces of a hand that points are matched to, by name."""

from depthtrack.hand.shape import HandShape
from depthtrack.rendering.backends import create_scorer
from depthtrack.solver.correspondences import Surface
from depthtrack.solver.options import SurfaceName, SurfaceOptions
from depthtrack.tracking.surfaces.capsules import CapsuleSurface
from depthtrack.tracking.surfaces.points import PointSurface
from depthtrack.tracking.surfaces.primitives import primitive_points
from depthtrack.tracking.surfaces.skin import skin_points

DEFAULTS = SurfaceOptions()


def make_surface(
    name: SurfaceName, hand: HandShape, renderer: str = "raster", options: SurfaceOptions = DEFAULTS
) -> Surface:
    """Return the surface of a hand.

    renderer: backend that finds which cylinders are hidden.

    Raises:
        InputError: if no skin fits the sizes of the hand.
    """
    if name == "cylinders":
        return CapsuleSurface(hand, create_scorer(renderer, hand), options)
    points = skin_points(hand, options.spacing) if name == "skin" else primitive_points(hand, options.spacing)
    return PointSurface(points, options)

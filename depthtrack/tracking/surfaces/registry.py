"""The surfaces of a hand that points are matched to, by name."""

from functools import lru_cache
from threading import Lock

from depthtrack.hand.shape import HandShape
from depthtrack.rendering.backends import create_scorer
from depthtrack.solver.options import SurfaceName, SurfaceOptions
from depthtrack.solver.surface import Surface
from depthtrack.solver.surface_points import PointBlocks
from depthtrack.tracking.surfaces.capsules import CapsuleSurface
from depthtrack.tracking.surfaces.points import PointSurface
from depthtrack.tracking.surfaces.primitives import primitive_points
from depthtrack.tracking.surfaces.skin import skin_points

DEFAULTS = SurfaceOptions()
_MAKING = Lock()


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
    # Threads that need the same points wait for them, instead of making them too.
    with _MAKING:
        points = _points(name, hand, options.spacing)
    return PointSurface(points, options)


@lru_cache(maxsize=8)
def _points(name: SurfaceName, hand: HandShape, spacing: float) -> PointBlocks:
    """Return the points of a surface, which the fitters of a tracker share."""
    return PointBlocks.of(skin_points(hand, spacing) if name == "skin" else primitive_points(hand, spacing))

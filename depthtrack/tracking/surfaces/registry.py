"""The surfaces that a hand can be fitted by, by name."""

from typing import Literal

from depthtrack.errors import InputError
from depthtrack.hand.shape import HandShape
from depthtrack.solver.correspondences import Surface
from depthtrack.tracking.surfaces.capsules import CapsuleSurface
from depthtrack.tracking.surfaces.skin import MeshSurface

Model = Literal["skin", "cylinders"]


def make_surface(model: Model, shape: HandShape) -> Surface:
    """The surface of a hand that observations are matched to. Raises InputError for another name."""
    if model == "skin":
        return MeshSurface(shape)
    if model == "cylinders":
        return CapsuleSurface(shape)
    raise InputError(f"no hand model '{model}' for fitting: choose skin or cylinders")

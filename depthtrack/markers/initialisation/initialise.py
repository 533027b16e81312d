"""Initialisation of models in a frame of points without labels."""

from collections.abc import Sequence

import numpy as np

from depthtrack.errors import InputError
from depthtrack.markers.initialisation.options import InitialisationOptions
from depthtrack.markers.initialisation.paper import initialise_as_paper
from depthtrack.markers.initialisation.search import initialise_by_search
from depthtrack.markers.initialisation.started import StartedModels
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array


def initialise(
    points: Array, models: Sequence[MarkerModel], options: InitialisationOptions | None = None
) -> StartedModels:
    """Return which points of a frame are which markers, and the poses and sizes of the models.

    points: (K, 3) metres, capture frame; points that are not finite are never assigned.
    models: hands and rigid bodies, all different; several may share a cluster, unless the paper's method is chosen.

    Raises:
        InputError: if there is no model.
    """
    options = options or InitialisationOptions()
    if not models:
        raise InputError("an initialisation needs a model: give a layout or the file of a model")
    measured = np.flatnonzero(np.isfinite(points).all(axis=-1))
    if options.method == "paper":
        found = initialise_as_paper(points[measured], tuple(models), options.paper)
    else:
        found = initialise_by_search(points[measured], tuple(models), options.search)
    return StartedModels(tuple(started if started is None else started.renumbered(measured) for started in found))

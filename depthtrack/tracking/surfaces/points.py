"""Surface given by points with normals, for searches of correspondences.

A posed point is visible if it faces the camera and no nearer point hides it. The visible points are sorted into cells
of the image. The search visits the cells around an observed point until no other cell can contain a closer point.
"""

from copy import copy
from typing import Self

import numpy as np

from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.segmentation.observation import Observation
from depthtrack.solver.closest_points import Groups, grouped
from depthtrack.solver.correspondences import Correspondences, PointCloud
from depthtrack.solver.options import SurfaceOptions
from depthtrack.solver.point_search import PointSearch, match_points
from depthtrack.solver.surface_points import PointBlocks
from depthtrack.solver.visible_points import Cells, cells_over
from depthtrack.types import Array


class PointSurface:
    """Surface given by points: see `solver.surface.Surface`."""

    def __init__(self, blocks: PointBlocks, options: SurfaceOptions) -> None:
        self._blocks, self._options = blocks, options
        self._posed = np.empty_like(blocks.rest)

    def set_target(self, observation: Observation, cloud: PointCloud, max_distance: float) -> None:
        size, points = self._options.cell, cloud.points
        self._max_distance, self._observation = max_distance, observation
        # The clouds of the observation live as long as it does.
        key = ("cells", id(points), size, max_distance)
        self._cells = observation.shared(key, lambda: cells_over(points, size, max_distance))
        self._searches: list[PointSearch] = []

    def arranged(self, cloud: PointCloud) -> PointCloud:
        observation, cells = self._observation, self._cells
        key = ("groups", id(cloud.points), cells)
        arranged, groups = observation.shared(key, lambda: _in_groups(cloud, cells, observation.centre))
        groups = groups.with_own_memory()
        limits = self._options.hidden_depth, self._max_distance
        self._searches.append(
            PointSearch(self._blocks, self._posed, cells, arranged, groups, observation.centre, *limits)
        )
        return arranged

    def search(self, cloud: PointCloud) -> PointSearch:
        return self._search_of(cloud)

    def twin(self) -> Self:
        other = copy(self)
        other._posed = np.empty_like(self._posed)
        other._searches = [
            search._replace(posed=other._posed, groups=search.groups.with_own_memory()) for search in self._searches
        ]
        return other

    def _search_of(self, cloud: PointCloud) -> PointSearch:
        """Return the search of an arranged cloud of the target."""
        return next(search for search in self._searches if search.cloud is cloud)

    def match(
        self,
        pose: Array,
        bodies: BodyPoses,
        cloud: PointCloud,
        min_normal_cosine: float,
        correspondences: Correspondences,
    ) -> None:
        match_points(self._search_of(cloud), bodies, min_normal_cosine, correspondences)


def _in_groups(cloud: PointCloud, cells: Cells, origin: Array) -> tuple[PointCloud, Groups]:
    """Return a cloud in the order of its groups, and the groups; surfaces share them."""
    points, normals, groups = grouped(cloud.points, cloud.normals, cells, origin)
    return PointCloud(points, normals), groups

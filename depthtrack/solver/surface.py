"""The protocol of surfaces that observed points are matched to."""

from typing import Protocol, Self

from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.segmentation.observation import Observation
from depthtrack.solver.correspondences import Correspondences, PointCloud
from depthtrack.solver.point_search import PointSearch
from depthtrack.types import Array


class Surface(Protocol):
    """Surface of the hand, for searches of correspondences."""

    def set_target(self, observation: Observation, cloud: PointCloud, max_distance: float) -> None:
        """Prepare searches for the points of a cloud.

        cloud: whose points span the region of the searches.
        max_distance: largest distance of a correspondence, m.
        """
        ...

    def arranged(self, cloud: PointCloud) -> PointCloud:
        """Return the points of the target, or some of them, in an order that makes searches fast."""
        ...

    def search(self, cloud: PointCloud) -> PointSearch | None:
        """Return the arguments of `point_search.fit_rounds` for an arranged cloud, if any."""
        ...

    def twin(self) -> Self | None:
        """Return a surface with the same target and its own memory; None if it has to share some."""
        ...

    def match(
        self,
        pose: Array,
        bodies: BodyPoses,
        cloud: PointCloud,
        min_normal_cosine: float,
        correspondences: Correspondences,
    ) -> None:
        """Write the closest visible points of the hand to `correspondences`.

        pose: (27,), in which `bodies` are placed already.
        min_normal_cosine: smallest cosine between the normals of surface and observation.
        """
        ...

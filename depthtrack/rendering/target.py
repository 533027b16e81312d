"""What hypotheses are scored against: the silhouette and depth maps of a region of interest, at any resolution."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.types import Depth, Index, Mask


@dataclass(frozen=True)
class Target:
    """The maps O = (o_s, o_d) of Oikonomidis et al. 2011, Sec. 2.1, that a scorer compares hypotheses with.

    `camera`: of the region of interest.
    `silhouette` (h, w): True for pixels of the hand's silhouette.
    `depth` (h, w): metres, 0 where there is no reading of the hand.

    Raises:
        InputError: if a map differs in shape from the camera's image, or a depth is negative or not finite.
    """

    camera: Camera
    silhouette: Mask
    depth: Depth

    def __post_init__(self) -> None:
        object.__setattr__(self, "silhouette", np.ascontiguousarray(self.silhouette, dtype=np.bool_))
        object.__setattr__(self, "depth", np.ascontiguousarray(self.depth, dtype=np.float32))
        for name, found in (("silhouette", self.silhouette.shape), ("depth", self.depth.shape)):
            if found != self.camera.shape:
                raise InputError(f"the {name} map must be {self.camera.shape} as its camera says, found {found}")
        if not np.all(np.isfinite(self.depth)) or self.depth.min() < 0:
            raise InputError("the depth map must hold finite metres, 0 where there is no reading")

    @classmethod
    def blank(cls, camera: Camera) -> "Target":
        """Return a target in which nothing is observed."""
        return Target(camera, np.zeros(camera.shape, np.bool_), np.zeros(camera.shape, np.float32))

    def crop(self, region: Rect) -> "Target":
        """Return the part in a region, which may reach outside: nothing is observed there."""
        return Target(self.camera.crop(region), region.crop(self.silhouette), region.crop(self.depth))

    def reduced(self, side: int) -> "Target":
        """Return the target sampled so that its longer side has at most `side` pixels.

        Depths are picked, never averaged, for an average of two surfaces lies on neither.

        Raises:
            InputError: if `side` is less than 1.
        """
        if side < 1:
            raise InputError(f"a reduced region needs at least 1 pixel a side, found {side}")
        factor = side / max(self.camera.shape)
        if factor >= 1:
            return self
        camera = self.camera.resized(factor)
        columns = _nearest((np.arange(camera.width) + 0.5) / factor - 0.5, self.camera.width)
        rows = _nearest((np.arange(camera.height) + 0.5) / factor - 0.5, self.camera.height)
        pick = np.ix_(rows, columns)
        return Target(camera, self.silhouette[pick], self.depth[pick])


def _nearest(position: NDArray[np.floating], size: int) -> Index:
    return np.clip(np.rint(position).astype(np.int64), 0, size - 1)

"""The observed silhouette and depth maps that hypotheses are scored against."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.types import Depth, Index, Mask


@dataclass(frozen=True)
class Target:
    """The observed maps O = (o_s, o_d) of Oikonomidis et al. 2011, Sec. 2.1.

    camera: of the region of interest.
    silhouette: (h, w) true for pixels of the hand.
    depth: (h, w) metres, 0 = no reading of the hand.

    Raises:
        ValueError: if a map differs in shape from the camera's image, or a depth is negative or not finite.
    """

    camera: Camera
    silhouette: Mask
    depth: Depth

    def __post_init__(self) -> None:
        object.__setattr__(self, "silhouette", np.ascontiguousarray(self.silhouette, dtype=np.bool_))
        object.__setattr__(self, "depth", np.ascontiguousarray(self.depth, dtype=np.float32))
        for name, found in (("silhouette", self.silhouette.shape), ("depth", self.depth.shape)):
            if found != self.camera.shape:
                raise ValueError(f"the {name} map must have the camera's shape {self.camera.shape}, found {found}")
        if not np.all(np.isfinite(self.depth)) or self.depth.min() < 0:
            raise ValueError("the depth map must hold finite metres, 0 where there is no reading")

    @classmethod
    def blank(cls, camera: Camera) -> "Target":
        """Return a target in which nothing is observed."""
        return Target(camera, np.zeros(camera.shape, np.bool_), np.zeros(camera.shape, np.float32))

    def crop(self, region: Rect) -> "Target":
        """Return the part in a region, which may extend outside, where nothing is observed."""
        return Target(self.camera.crop(region), region.crop(self.silhouette), region.crop(self.depth))

    def reduced(self, side: int) -> "Target":
        """Return the target sampled so that its longer side has at most `side` pixels.

        Each depth is the nearest pixel's, since the average of two surfaces lies on neither.

        side: an option of the user.

        Raises:
            InputError: if `side` is less than 1.
        """
        if side < 1:
            raise InputError(f"the resolution must be at least 1 pixel, found {side}")
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

"""What hypotheses are scored against: the skin and depth maps of a region of interest, at any resolution."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.types import Depth, Index, Mask


@dataclass(frozen=True)
class Target:
    """Observation O = (o_s, o_d) of Oikonomidis et al. 2011, Sec. 2.1.

    `skin` (h, w) bool and `depth` (h, w) float32 metres (0 = missing) as `camera` sees them.
    """

    camera: Camera
    skin: Mask
    depth: Depth

    def __post_init__(self) -> None:
        object.__setattr__(self, "skin", np.ascontiguousarray(self.skin, dtype=np.bool_))
        object.__setattr__(self, "depth", np.ascontiguousarray(self.depth, dtype=np.float32))
        for name, found in (("skin", self.skin.shape), ("depth", self.depth.shape)):
            if found != self.camera.shape:
                raise InputError(f"the {name} map must be {self.camera.shape} as its camera says, found {found}")
        if not np.all(np.isfinite(self.depth)) or self.depth.min() < 0:
            raise InputError("the depth map must hold finite metres, 0 where there is no reading")

    def window(self, left: int, top: int, width: int, height: int) -> Self:
        """The part in a window, which may reach outside: nothing is observed there."""
        skin, depth = np.zeros((height, width), np.bool_), np.zeros((height, width), np.float32)
        u0, u1 = max(left, 0), max(min(left + width, self.camera.width), 0)
        v0, v1 = max(top, 0), max(min(top + height, self.camera.height), 0)
        if u0 < u1 and v0 < v1:
            inside = (slice(v0 - top, v1 - top), slice(u0 - left, u1 - left))
            skin[inside], depth[inside] = self.skin[v0:v1, u0:u1], self.depth[v0:v1, u0:u1]
        return type(self)(self.camera.crop(left, top, width, height), skin, depth)

    def reduced(self, side: int) -> Self:
        """Sampled so that the longer side has at most `side` pixels; depths are picked, never averaged."""
        if side < 1:
            raise InputError(f"a reduced region needs at least 1 pixel a side, found {side}")
        factor = side / max(self.camera.shape)
        if factor >= 1:
            return self
        camera = self.camera.resized(factor)
        columns = _nearest((np.arange(camera.width) + 0.5) / factor - 0.5, self.camera.width)
        rows = _nearest((np.arange(camera.height) + 0.5) / factor - 0.5, self.camera.height)
        pick = np.ix_(rows, columns)
        return type(self)(camera, self.skin[pick], self.depth[pick])


def _nearest(position: NDArray[np.floating], size: int) -> Index:
    return np.clip(np.rint(position).astype(np.int64), 0, size - 1)

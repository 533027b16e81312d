"""The observed silhouette and depth maps that hypotheses are scored against."""

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.types import Array, Depth, Index, Mask


@dataclass(frozen=True)
class Target:
    """The observed maps O = (o_s, o_d) of Oikonomidis et al. 2011, Sec. 2.1.

    camera: of the region of interest.
    silhouette: (h, w) true for pixels of the hand.
    depth: (h, w) metres, 0 = no reading of the hand.
    occluder: (h, w) metres, depth up to which an object before the hand is solid, 0 = no object; None for none at all.
    surroundings: (h, w) metres, readings that are not of the hand, such as the forearm's, 0 = none; None if unknown.
        What is too near for a reading has a small depth.

    A hypothesis may lie behind the occluder. What lies before it or inside it costs more in Eq. (2).
    What lies well behind the surroundings costs nothing there.

    Raises:
        ValueError: if a map differs in shape from the camera's image, or a depth is negative or not finite.
    """

    camera: Camera
    silhouette: Mask
    depth: Depth
    occluder: Depth | None = field(default=None, kw_only=True)
    surroundings: Depth | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "silhouette", np.ascontiguousarray(self.silhouette, dtype=np.bool_))
        object.__setattr__(self, "depth", np.ascontiguousarray(self.depth, dtype=np.float32))
        for name in ("occluder", "surroundings"):
            if (given := getattr(self, name)) is not None:
                object.__setattr__(self, name, np.ascontiguousarray(given, dtype=np.float32))
        for name in ("silhouette", "depth", "occluder", "surroundings"):
            if (found := getattr(self, name)) is None:
                continue
            if found.shape != self.camera.shape:
                raise ValueError(
                    f"the {name} map must have the camera's shape {self.camera.shape}, found {found.shape}"
                )
            # Numbers that are not finite show in the extremes.
            if name != "silhouette" and not (found.min() >= 0 and np.isfinite(found.max())):
                raise ValueError(f"the {name} map must hold finite metres, 0 where there is no reading")

    @classmethod
    def blank(cls, camera: Camera) -> "Target":
        """Return a target in which nothing is observed."""
        return Target(camera, np.zeros(camera.shape, np.bool_), np.zeros(camera.shape, np.float32))

    def crop(self, region: Rect) -> "Target":
        """Return the part in a region, which may extend outside, where nothing is observed."""
        occluder = None if self.occluder is None else region.crop(self.occluder)
        surroundings = None if self.surroundings is None else region.crop(self.surroundings)
        silhouette, depth = region.crop(self.silhouette), region.crop(self.depth)
        return Target(self.camera.crop(region), silhouette, depth, occluder=occluder, surroundings=surroundings)

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
        occluder = None if self.occluder is None else self.occluder[pick]
        surroundings = None if self.surroundings is None else self.surroundings[pick]
        return Target(camera, self.silhouette[pick], self.depth[pick], occluder=occluder, surroundings=surroundings)

    def hidden_from(self, behind: float) -> Depth:
        """Return the inverse depth (h, w), 1/m, from which on a surface is hidden.

        It is 0 without an occluder: a visible surface has a larger inverse depth.

        behind: depth behind the occluder's readings, metres.
        """
        if self.occluder is None:
            return np.zeros(self.camera.shape, np.float32)
        return np.where(self.occluder > 0, np.float32(1) / (self.occluder + np.float32(behind)), np.float32(0))

    def seen_from(self, behind: float) -> Depth:
        """Return the inverse depth (h, w), 1/m, that a surface before the surroundings exceeds.

        It is 0 without surroundings, and on the occluder.

        behind: depth behind their readings from which on they hide it, metres.
        """
        around = self._around_occluder
        if around is None or math.isinf(behind):
            return np.zeros(self.camera.shape, np.float32)
        return np.where(around > 0, np.float32(1) / (around + np.float32(behind)), np.float32(0))

    @cached_property
    def hiding(self) -> Depth | None:
        """Depth (h, w) of what may hide the hand, metres, 0 = nothing.

        It is that of the occluder, elsewhere of the surroundings.
        """
        if self.occluder is None or self.surroundings is None:
            return self.surroundings if self.occluder is None else self.occluder
        return np.where(self.occluder > 0, self.occluder, self.surroundings)

    def unhidden(self, rendered: Depth, behind: float) -> Depth:
        """Return a rendered depth map (h, w), metres, with 0 where it is hidden.

        It is the same map if occluder and surroundings hide nothing.

        behind: depth behind their readings, metres.
        """
        if self.hiding is None:
            return rendered
        hidden = (self.hiding > 0) & (rendered >= self.hiding + np.float32(behind))
        return np.where(hidden, np.float32(0), rendered) if hidden.any() else rendered

    def before_surroundings(self, rendered: ArrayLike, behind: float) -> Array:
        """Return a rendered depth map (h, w), metres, with 0 where the surroundings hide it.

        The occluder hides nothing here.

        behind: depth behind their readings, metres.
        """
        depth, around = np.asarray(rendered, dtype=np.float64), self._around_occluder
        if around is None:
            return depth
        return np.where((around > 0) & (depth >= around.astype(np.float64) + behind), 0.0, depth)

    @cached_property
    def _around_occluder(self) -> Depth | None:
        """Surroundings (h, w) without those on the occluder, which hides in its own way."""
        if self.surroundings is None or self.occluder is None:
            return self.surroundings
        return np.where(self.occluder > 0, np.float32(0), self.surroundings)

    def before_occluder(self, rendered: ArrayLike, behind: float) -> Mask | None:
        """Return where (h, w) a surface lies before or inside the occluder; None without one.

        rendered: (h, w) its depth, metres, 0 for none.
        behind: depth behind the occluder's readings, metres.
        """
        if self.occluder is None:
            return None
        depth = np.asarray(rendered, dtype=np.float64)
        inside = depth < self.occluder.astype(np.float64) + behind
        return np.asarray((self.occluder > 0) & (depth > 0) & inside, dtype=np.bool_)


def _nearest(position: NDArray[np.floating], size: int) -> Index:
    return np.clip(np.rint(position).astype(np.int64), 0, size - 1)

"""Pinhole cameras.

Camera frame: x right, y down, z forward. Pixel centres have integer coordinates.
"""

from dataclasses import asdict, dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthtrack.errors import InputError
from depthtrack.files import compact_json
from depthtrack.geometry.rectangle import Rect
from depthtrack.types import Array, Depth, Index

MAX_SIDE = 8192
"""Largest image side accepted, pixels: a bound on the memory that a damaged header requests."""


@dataclass(frozen=True)
class Camera:
    """Intrinsics of an undistorted pinhole camera, in pixels.

    depth_scale: metres per unit of a stored 16-bit depth image.

    Raises:
        InputError: if a value is out of range.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    depth_scale: float = 0.001

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            side = getattr(self, name)
            if not (isinstance(side, int) and 1 <= side <= MAX_SIDE):
                raise InputError(f"camera {name} must be a whole number from 1 to {MAX_SIDE} pixels, found {side!r}")
        for name in ("fx", "fy"):
            # A region may have any ratio of focal length to side; `from_fields` is stricter with files.
            if not (_is_number(getattr(self, name)) and 1e-3 <= getattr(self, name) <= 1e6):
                raise InputError(f"camera {name} must be a focal length in pixels, found {getattr(self, name)!r}")
        for name in ("cx", "cy"):
            # A region may lie far from the principal point, so the range is wide.
            if not (_is_number(getattr(self, name)) and abs(getattr(self, name)) <= 4 * MAX_SIDE):
                raise InputError(f"camera {name} must be a principal point in pixels, found {getattr(self, name)!r}")
        if not (_is_number(self.depth_scale) and 1e-6 <= self.depth_scale <= 0.1):
            raise InputError(
                f"camera depth_scale must be metres per depth unit (0.001 for millimetres), found {self.depth_scale!r}"
            )
        # Whole numbers would be other types to kernels, which would be compiled for them as well.
        for name in ("fx", "fy", "cx", "cy", "depth_scale"):
            object.__setattr__(self, name, float(getattr(self, name)))

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width), as numpy orders an image."""
        return self.height, self.width

    @property
    def matrix(self) -> Array:
        """(3, 3) intrinsic matrix K."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1]], dtype=np.float64)

    def project(self, points: ArrayLike) -> Array:
        """Return the pixels (..., 2) of camera-frame points (..., 3), metres; NaN if z <= 0."""
        p = np.asarray(points, dtype=np.float64)
        z = np.where(p[..., 2] > 0, p[..., 2], np.nan)
        return np.stack([self.fx * p[..., 0] / z + self.cx, self.fy * p[..., 1] / z + self.cy], axis=-1)

    def unproject(self, pixels: ArrayLike, depth: ArrayLike) -> Array:
        """Return the camera-frame points (..., 3), metres, of pixels (..., 2) at depths (...)."""
        uv = np.asarray(pixels, dtype=np.float64)
        z = np.asarray(depth, dtype=np.float64)
        return np.stack([(uv[..., 0] - self.cx) / self.fx * z, (uv[..., 1] - self.cy) / self.fy * z, z], axis=-1)

    def unproject_rows(self, rows: Index, depth: Array) -> Array:
        """Return the camera-frame points (N, 3), metres, of some pixels of a depth map (h, w).

        rows: (N,) their places in the flat map.
        """
        v, u = np.divmod(rows, self.width)
        return self.unproject(np.stack([u, v], axis=-1), depth.reshape(-1)[rows])

    def metres(self, stored: NDArray[np.uint16]) -> Depth:
        """Return the depth (h, w) in metres of an image of stored units (h, w); 0 stays 0."""
        metres = stored.astype(np.float32)
        metres *= np.float32(self.depth_scale)
        return metres

    @property
    def rect(self) -> Rect:
        """The whole image."""
        return Rect(0, 0, self.width, self.height)

    def rect_around(self, centre: ArrayLike, reach: float) -> Rect:
        """Return the part of the image, at least one pixel, that points near `centre` may cover.

        centre: (3,) metres, camera frame, z > 0.
        reach: metres across the line of sight.
        """
        point = np.asarray(centre, dtype=np.float64)
        (u, v), z = self.project(point), float(point[2])
        du, dv = self.fx * reach / z, self.fy * reach / z
        left, top = min(max(int(u - du), 0), self.width - 1), min(max(int(v - dv), 0), self.height - 1)
        right, bottom = min(max(int(u + du), left) + 1, self.width), min(max(int(v + dv), top) + 1, self.height)
        return Rect(left, top, right, bottom)

    def crop(self, region: Rect) -> Self:
        """Return the camera of a region of the image; the region may extend outside."""
        return replace(
            self, width=region.width, height=region.height, cx=self.cx - region.left, cy=self.cy - region.top
        )

    def resized(self, factor: float) -> Self:
        """Return the camera of the image resampled by `factor`, with fixed outer corners."""
        return replace(
            self,
            width=max(1, round(self.width * factor)),
            height=max(1, round(self.height * factor)),
            fx=self.fx * factor,
            fy=self.fy * factor,
            cx=(self.cx + 0.5) * factor - 0.5,
            cy=(self.cy + 0.5) * factor - 0.5,
        )

    def to_json(self) -> str:
        """Return the text of `camera.json`."""
        return compact_json(asdict(self))

    @classmethod
    def from_fields(cls, fields: Any) -> Self:
        """Return the camera of the parsed contents of a `camera.json`.

        Raises:
            InputError: if an entry is missing, or the field of view is below 0.5 or above 170 degrees.
        """
        required = ("width", "height", "fx", "fy", "cx", "cy")
        if not isinstance(fields, dict) or any(name not in fields for name in required):
            raise InputError(f"a camera must be a JSON object with {', '.join(required)} (and depth_scale)")
        camera = cls(**{name: fields[name] for name in (*required, "depth_scale") if name in fields})
        # A value outside this range has another unit or is another column.
        for name in ("fx", "fy"):
            focal = getattr(camera, name)
            if not 0.04 <= focal / max(camera.shape) <= 120:
                raise InputError(f"camera {name} must be a focal length in pixels, found {focal:g}")
        return camera


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e12  # false for NaN


PRESETS: dict[str, Camera] = {
    # Nominal factory intrinsics: Kinect v1 as OpenNI registers depth to colour, Kinect v2 and SR300 depth cameras.
    "kinect1": Camera(640, 480, 525.0, 525.0, 319.5, 239.5, 0.001),
    "kinect2": Camera(512, 424, 365.5, 365.5, 255.5, 211.5, 0.001),
    "realsense": Camera(640, 480, 475.0, 475.0, 319.5, 239.5, 0.000125),
    # Recommended by the TUM RGB-D benchmark for registered recordings; its depth unit is 1/5000 m.
    "tum": Camera(640, 480, 525.0, 525.0, 319.5, 239.5, 0.0002),
}
"""Cameras by sensor name, for synthesis and for recordings without intrinsics."""

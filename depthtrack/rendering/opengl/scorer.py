"""The `egl` and `osmesa` backends: hypotheses drawn as impostors in tiles of an atlas.

Source: Oikonomidis et al. 2011, Sec. 2.5.
"""

import weakref
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.errors import InputError
from depthtrack.hand.primitives import PRIMITIVE_COUNT
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.objective import Terms
from depthtrack.rendering.opengl.context import Context, Device, Platform
from depthtrack.rendering.opengl.impostors import VECTORS, HandTable, place_impostors
from depthtrack.rendering.opengl.renderer import Renderer, TileGrid, shared_renderer
from depthtrack.rendering.opengl.sums import sum_tiles
from depthtrack.rendering.options import Objective
from depthtrack.rendering.scorer import ScorerBase, as_batch
from depthtrack.rendering.target import Target
from depthtrack.types import Array, Array32, Depth, Index

Sums = Literal["gpu", "cpu"]

_PARTS, _SMALLEST_PART = 2, 16
"""A software renderer gets a batch in parts: one is summed while the next is drawn."""


class OpenGLScorer(ScorerBase):
    """Scores hypotheses drawn by OpenGL; `renderer` and `software` describe the renderer.

    platform: "egl" or "osmesa".
    sums: where Eq. (2) is summed: by shaders ("gpu") or after reading tiles back ("cpu"). The default is "cpu" for a
        software renderer, else "gpu".
    device: see `opening.open_context`.

    Scorers of one device share its context.

    Raises:
        InputError: if `platform` or `sums` has another value.
        OpenGLError: if OpenGL is unusable here.
    """

    def __init__(
        self,
        shape: HandShape,
        objective: Objective | None = None,
        platform: Platform = "egl",
        sums: Sums | None = None,
        device: Device = None,
    ) -> None:
        if platform not in ("egl", "osmesa"):
            raise InputError(f"the OpenGL platform must be 'egl' or 'osmesa', found {platform!r}")
        if sums not in (None, "gpu", "cpu"):
            raise InputError(f"sums must be 'gpu' or 'cpu', found {sums!r}")
        self.name: str = platform
        self._objective = objective or Objective()
        self._hand = HandTable.of(shape)
        self._renderer: Renderer | None = shared_renderer(platform, device)
        context = self._renderer.context
        self.renderer, self.software = context.renderer, context.software
        self.sums: Sums = sums or ("cpu" if context.software else "gpu")
        self._textures: list[int] = []
        self._instances = np.empty((0, VECTORS, 4), np.float32)
        self._pixels = np.empty(0, np.float32)
        self._release = weakref.finalize(self, _discard, context, self._textures)

    def set_target(self, target: Target) -> None:
        camera = target.camera
        # A camera file may hold integers; floats need only one compiled kernel.
        self._intrinsics = float(camera.fx), float(camera.fy), float(camera.cx), float(camera.cy)
        self._silhouette = target.silhouette.astype(np.float32)
        self._hidden_from = target.hidden_from(self._objective.hidden_depth)
        self._seen_from = target.seen_from(self._objective.surroundings_depth)
        clamped = np.minimum(target.depth, self._objective.clamp_depth, dtype=np.float64).sum()
        self._empty = float(clamped), 0.0, float(np.count_nonzero(target.silhouette))
        if self.sums == "gpu":
            with self._open.context as gl:
                if not self._textures:
                    self._textures.append(self._open.new_texture(gl))
                maps = np.stack([target.depth, self._silhouette, self._hidden_from, self._seen_from], axis=-1)
                self._open.upload(gl, self._textures[0], maps)
        self._target = target

    def score(self, poses: ArrayLike) -> Array:
        return self.terms(poses).energy

    def terms(self, poses: ArrayLike) -> Terms:
        batch, renderer = as_batch(poses), self._open
        sums, regions = np.empty((len(batch), 3)), np.empty((len(batch), 4), np.int64)
        with renderer.context as gl:
            grid = renderer.grid(gl, *self.target.camera.shape)
            size = self._part_size(grid, len(batch))
            drawn: slice | None = None
            for turn, start in enumerate(range(0, len(batch), size)):
                part = slice(start, min(start + size, len(batch)))
                self._draw(gl, turn % 2, grid, batch[part], regions[part])
                if drawn is not None:
                    self._sum(gl, 1 - turn % 2, grid, regions[drawn], sums[drawn])
                drawn = part
            if drawn is not None:
                self._sum(gl, turn % 2, grid, regions[drawn], sums[drawn])
        return Terms.of_sums(self._objective, batch, *sums.T)

    def render(self, pose: ArrayLike) -> Depth:
        batch, renderer = as_batch(np.asarray(pose)[None]), self._open
        with renderer.context as gl:
            grid = renderer.grid(gl, *self.target.camera.shape)
            self._draw(gl, 0, grid, batch, np.empty((1, 4), np.int64))
            inverse_depth = self._read(gl, 0, grid, 1)
        return np.divide(1, inverse_depth, out=np.zeros_like(inverse_depth), where=inverse_depth > 0)

    def close(self) -> None:
        self._renderer = None
        self._release()

    @property
    def _open(self) -> Renderer:
        if self._renderer is None:
            raise RuntimeError("this scorer is closed: create a new one")
        return self._renderer

    def _part_size(self, grid: TileGrid, count: int) -> int:
        wanted = max(-(-count // _PARTS), _SMALLEST_PART) if self.software else count
        return max(min(wanted, grid.capacity), 1)

    def _draw(self, gl: Any, which: int, grid: TileGrid, poses: Array, regions: Index) -> None:
        if len(self._instances) < len(poses) * PRIMITIVE_COUNT:
            self._instances = np.empty((len(poses) * PRIMITIVE_COUNT, VECTORS, 4), np.float32)
        tile = grid.height, grid.width
        count = place_impostors(poses, self._hand, self._intrinsics, tile, grid.columns, self._instances, regions)
        self._open.draw(gl, which, grid, len(poses), self._instances[:count])

    def _read(self, gl: Any, which: int, grid: TileGrid, count: int) -> Array32:
        height, width = grid.extent(count)
        if self._pixels.size < height * width:
            self._pixels = np.empty(height * width, np.float32)
        pixels = self._pixels[: height * width].reshape(height, width)
        self._open.read(gl, which, pixels)
        return pixels

    def _sum(self, gl: Any, which: int, grid: TileGrid, regions: Index, sums: Array) -> None:
        o, target = self._objective, self.target
        limits = o.match_depth, o.clamp_depth, float(o.before_cost)
        if self.sums == "gpu":
            sums[:] = self._open.sum(gl, which, grid, len(sums), self._textures[0], limits)
        else:
            pixels = self._read(gl, which, grid, len(sums))
            maps = target.depth, self._silhouette, self._hidden_from, self._seen_from
            sum_tiles(pixels, grid.columns, regions, *maps, self._empty, *limits, sums)


def _discard(context: Context, textures: list[int]) -> None:
    while textures:
        context.discard_texture(textures.pop())

"""The renderer of an OpenGL context: tiles of hypotheses and their sums of Eq. (2)."""

import ctypes
import threading
from dataclasses import dataclass
from typing import Any

import numpy as np

from depthtrack.errors import InputError
from depthtrack.rendering.opengl.context import Context, Device, OpenGLError, Platform
from depthtrack.rendering.opengl.impostors import VECTORS
from depthtrack.rendering.opengl.opening import open_context
from depthtrack.rendering.opengl.programs import Program
from depthtrack.rendering.rendered_surface import NEAR
from depthtrack.types import Array, Array32

_BLOCK = 4
"""Side of the blocks that one level of the pyramid sums, in pixels; the shaders repeat it."""
_SIDE_SOFTWARE, _SIDE_HARDWARE = 1024, 2048
"""Side of an atlas, pixels. The small one fits a processor's cache, the large one keeps a GPU busy."""


@dataclass(frozen=True)
class TileGrid:
    """Tiles of `height` x `width` pixels in an atlas: `columns` a row, at most `capacity`."""

    height: int
    width: int
    columns: int
    capacity: int

    def rows(self, count: int) -> int:
        """Return the rows that `count` tiles fill, the last one perhaps in part."""
        return -(-count // self.columns)

    def extent(self, count: int) -> tuple[int, int]:
        """Return the (height, width), pixels, of the part of the atlas that `count` tiles fill."""
        return self.rows(count) * self.height, min(count, self.columns) * self.width


class Atlas:
    """A square float texture to draw tiles into; its context must be current.

    Raises:
        OpenGLError: if the driver cannot draw into such a texture.
    """

    def __init__(self, gl: Any, side: int, internal_format: int, pixel_format: int) -> None:
        self.side = side
        self.texture, self.framebuffer = _texture(gl), gl.glGenFramebuffers(1)
        gl.glTexImage2D(gl.GL_TEXTURE_2D, 0, internal_format, side, side, 0, pixel_format, gl.GL_FLOAT, None)
        gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, self.framebuffer)
        gl.glFramebufferTexture2D(gl.GL_FRAMEBUFFER, gl.GL_COLOR_ATTACHMENT0, gl.GL_TEXTURE_2D, self.texture, 0)
        if gl.glCheckFramebufferStatus(gl.GL_FRAMEBUFFER) != gl.GL_FRAMEBUFFER_COMPLETE:
            raise OpenGLError(f"this OpenGL driver cannot draw into float textures of {side} x {side} pixels")

    def delete(self, gl: Any) -> None:
        """Delete the texture and its framebuffer."""
        gl.glDeleteFramebuffers(1, [self.framebuffer])
        gl.glDeleteTextures(1, [self.texture])


class Renderer:
    """Programs, buffers and atlases of one context.

    Methods need the context to be current: `with renderer.context as gl`.
    """

    def __init__(self, context: Context) -> None:
        self.context = context
        with context as gl:
            self._impostor = Program(gl, "impostor.vert", "impostor.frag")
            self._compare = Program(gl, "cover.vert", "compare.frag")
            self._reduce = Program(gl, "cover.vert", "reduce.frag")
            self._no_vertices, self._vertices = gl.glGenVertexArrays(2)
            self._instances = gl.glGenBuffers(1)
            self._describe_instances(gl)
        self._atlases: list[Atlas] = []
        self._pyramid: list[Atlas] = []
        self._side = min(_SIDE_SOFTWARE if context.software else _SIDE_HARDWARE, context.max_side)

    def grid(self, gl: Any, height: int, width: int) -> TileGrid:
        """Return the grid of tiles of a size, pixels; enlarge the atlases if one does not fit.

        Raises:
            InputError: if the tile is larger than the renderer's largest texture.
        """
        if max(height, width) > self.context.max_side:
            raise InputError(
                f"{self.context.renderer} draws at most {self.context.max_side} pixels a side, "
                f"found a region of {width} x {height}: reduce it"
            )
        self._side = max(self._side, height, width)
        if not self._atlases or self._atlases[0].side < self._side:
            outgrown, self._atlases, self._pyramid = self._atlases + self._pyramid, [], []
            for atlas in outgrown:
                atlas.delete(gl)
            # One atlas is read back while the other is drawn.
            self._atlases = [Atlas(gl, self._side, gl.GL_R32F, gl.GL_RED) for _ in range(2)]
        # A tile narrower than a block still takes one block of the pyramid.
        columns, rows = self._side // max(width, _BLOCK), self._side // max(height, _BLOCK)
        columns, rows = max(columns, 1), max(rows, 1)
        return TileGrid(height, width, columns, columns * rows)

    def draw(self, gl: Any, which: int, grid: TileGrid, count: int, instances: Array32) -> None:
        """Start to draw the impostors (N, 6, 4) of `count` tiles into atlas `which`."""
        atlas = self._atlases[which]
        height, width = grid.extent(count)
        gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, atlas.framebuffer)
        gl.glViewport(0, 0, atlas.side, atlas.side)
        gl.glEnable(gl.GL_SCISSOR_TEST)
        gl.glScissor(0, 0, width, height)
        gl.glClear(gl.GL_COLOR_BUFFER_BIT)
        gl.glEnable(gl.GL_BLEND)
        gl.glBlendEquation(gl.GL_MAX)
        self._impostor.use(atlas_side=float(atlas.side), inverse_near=1 / NEAR)
        gl.glBindVertexArray(self._vertices)
        gl.glBindBuffer(gl.GL_ARRAY_BUFFER, self._instances)
        gl.glBufferData(gl.GL_ARRAY_BUFFER, instances.nbytes, instances, gl.GL_STREAM_DRAW)
        gl.glDrawArraysInstanced(gl.GL_TRIANGLE_STRIP, 0, 4, len(instances))
        gl.glFlush()

    def read(self, gl: Any, which: int, pixels: Array32) -> None:
        """Write the inverse depth, 1/m, of an atlas' first pixels to `pixels` (rows, columns).

        The call waits until they are drawn.
        """
        height, width = pixels.shape
        gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, self._atlases[which].framebuffer)
        gl.glReadPixels(0, 0, width, height, gl.GL_RED, gl.GL_FLOAT, pixels)

    def sum(
        self,
        gl: Any,
        which: int,
        grid: TileGrid,
        count: int,
        observation: int,
        limits: tuple[float, float, float],
    ) -> Array:
        """Return the sums (count, 3) of Eq. (2) over the tiles of an atlas; see `sums.sum_tiles`.

        observation: a texture written by `upload`.
        limits: d_m, d_M, metres; `Objective.before_cost`.

        The first level of the pyramid compares and the next ones add, until one texel a tile is left (Sec. 2.5).
        """
        if not self._pyramid:
            # Blocks take at most 2/5 of an atlas' side, reached by tiles of 5 pixels.
            self._pyramid = [Atlas(gl, self._side // 2, gl.GL_RGBA32F, gl.GL_RGBA) for _ in range(2)]
        gl.glDisable(gl.GL_BLEND)
        gl.glDisable(gl.GL_SCISSOR_TEST)
        gl.glBindVertexArray(self._no_vertices)
        gl.glActiveTexture(gl.GL_TEXTURE1)
        gl.glBindTexture(gl.GL_TEXTURE_2D, observation)
        gl.glActiveTexture(gl.GL_TEXTURE0)
        tiles, (level, spare) = (min(count, grid.columns), grid.rows(count)), self._pyramid
        match_depth, clamp_depth, before_cost = limits
        self._compare.use(
            inverse_depth=0, observation=1, match_depth=match_depth, clamp_depth=clamp_depth, before_cost=before_cost
        )
        size = self._add_blocks(gl, self._compare, self._atlases[which], level, tiles, (grid.width, grid.height))
        while size != (1, 1):
            self._reduce.use(level=0)
            size = self._add_blocks(gl, self._reduce, level, spare, tiles, size)
            level, spare = spare, level
        columns, rows = tiles
        sums = np.empty((rows, columns, 4), np.float32)
        gl.glReadPixels(0, 0, columns, rows, gl.GL_RGBA, gl.GL_FLOAT, sums)
        return sums.reshape(-1, 4)[:count, :3].astype(np.float64)

    def _add_blocks(
        self, gl: Any, program: Program, source: Atlas, target: Atlas, tiles: tuple[int, int], size: tuple[int, int]
    ) -> tuple[int, int]:
        """Reduce each block of 4 x 4 texels of the tiles to one texel with a program.

        tiles: (columns, rows).
        size: (width, height) of a tile in `source`, texels.

        Returns the size of a tile in `target`, whose framebuffer stays bound.
        """
        blocks = -(-size[0] // _BLOCK), -(-size[1] // _BLOCK)
        gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, target.framebuffer)
        gl.glViewport(0, 0, tiles[0] * blocks[0], tiles[1] * blocks[1])
        gl.glBindTexture(gl.GL_TEXTURE_2D, source.texture)
        program.use(tile=size, blocks=blocks)
        gl.glDrawArrays(gl.GL_TRIANGLES, 0, 3)
        return blocks

    def new_texture(self, gl: Any) -> int:
        """Return a texture for `upload`; `context.discard_texture` deletes it."""
        return _texture(gl)

    def upload(self, gl: Any, texture: int, observation: Array32) -> None:
        """Write an observation (h, w, 4) to a texture.

        It holds depth (metres), silhouette (0 or 1), and the inverse depths (1/m) that a surface before or inside
        an occluder exceeds, and one before the surroundings.
        """
        height, width, _ = observation.shape
        gl.glBindTexture(gl.GL_TEXTURE_2D, texture)
        gl.glTexImage2D(gl.GL_TEXTURE_2D, 0, gl.GL_RGBA32F, width, height, 0, gl.GL_RGBA, gl.GL_FLOAT, observation)

    def _describe_instances(self, gl: Any) -> None:
        gl.glBindVertexArray(self._vertices)
        gl.glBindBuffer(gl.GL_ARRAY_BUFFER, self._instances)
        size = VECTORS * 16
        for vector in range(VECTORS):
            gl.glEnableVertexAttribArray(vector)
            gl.glVertexAttribPointer(vector, 4, gl.GL_FLOAT, False, size, ctypes.c_void_p(16 * vector))
            gl.glVertexAttribDivisor(vector, 1)


def _texture(gl: Any) -> int:
    """Return a new texture, bound, without interpolation."""
    texture = int(gl.glGenTextures(1))
    gl.glBindTexture(gl.GL_TEXTURE_2D, texture)
    gl.glTexParameteri(gl.GL_TEXTURE_2D, gl.GL_TEXTURE_MIN_FILTER, gl.GL_NEAREST)
    gl.glTexParameteri(gl.GL_TEXTURE_2D, gl.GL_TEXTURE_MAG_FILTER, gl.GL_NEAREST)
    return texture


_shared: dict[tuple[Platform, Device], Renderer] = {}
_shared_lock = threading.Lock()


def shared_renderer(platform: Platform, device: Device = None) -> Renderer:
    """Return the renderer of a device, which the scorers of this process share.

    It is opened at its first use and kept until the process ends.

    Raises:
        OpenGLError: see `open_context`.
    """
    with _shared_lock:
        renderer = _shared.get((platform, device))
        if renderer is None or renderer.context.closed:
            renderer = _shared[platform, device] = Renderer(open_context(platform, device))
        renderer.context.require_own_process()
        return renderer

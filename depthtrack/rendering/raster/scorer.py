"""The `raster` backend: the kernel's arrays, and a batch divided among threads."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthtrack.errors import InputError
from depthtrack.hand.pose import POSE_SIZE
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.objective import Terms, silhouette_disagreement
from depthtrack.rendering.options import Objective
from depthtrack.rendering.raster import hand_constants as constants
from depthtrack.rendering.raster import kernel, quadrics, tiles
from depthtrack.rendering.scorer import ScorerBase, Scores, as_batch
from depthtrack.rendering.target import Target
from depthtrack.types import Array, Array32, Depth, Index

_THREAD_PIXELS = 500_000
"""Pixels, over all poses of a batch, that justify a thread. A worker takes about 60 us to wake, a tenth of the time to
score these pixels. So 64 poses of 96 x 96 pixels stay in the calling thread."""


@dataclass
class _Workspace:
    """Arrays of one thread: see `kernel.score_poses`."""

    buffer: Depth
    first: Index
    last: Index
    low: Index
    high: Index
    scratch: Array = field(default_factory=lambda: np.zeros(4 * constants.LANES))
    table: Array32 = field(default_factory=lambda: np.zeros(quadrics.COEFFICIENT_ROWS * quadrics.SLOTS, np.float32))

    @classmethod
    def of(cls, shape: tuple[int, int]) -> Self:
        columns, rows = tiles.tile_counts(shape)
        first, last = np.zeros((2, columns + 1), np.int64)
        return cls(tiles.new_tiled_image(shape), first, last, np.full(columns, rows), np.full(columns, -1))

    @property
    def arrays(self) -> tuple[NDArray[np.generic], ...]:
        return self.scratch, self.table, self.buffer, self.first, self.last, self.low, self.high


class RasterScorer(ScorerBase):
    """CPU rasteriser; the number of threads does not change the energies.

    Up to `threads` threads share a batch. Each scores a chunk of whole poses. Small batches stay in the calling thread.

    Raises:
        InputError: if `threads` is not within 1 to 256.
    """

    name = "raster"

    def __init__(self, shape: HandShape, objective: Objective | None = None, threads: int = 1) -> None:
        if not 1 <= threads <= 256:
            raise InputError(f"the rasteriser runs on 1 to 256 threads, found {threads}")
        self._objective = o = objective or Objective()
        self._hand = constants.hand_constants(shape)
        self._objective_constants = np.array(
            [o.match_depth, o.clamp_depth, o.depth_unit, o.epsilon, o.silhouette_weight, o.kinematic_weight]
        )
        self._camera, self._empty = np.empty(8), np.empty(3)
        self._allocate(256)
        self._threads = threads
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="depthtrack-raster")

    def set_target(self, target: Target) -> None:
        shape = target.camera.shape
        if self._target is None or self._target.camera.shape != shape:
            self._workspaces = [_Workspace.of(shape) for _ in range(self._threads)]
            self._observed, self._silhouette = tiles.new_tiled_image(shape), tiles.new_tiled_image(shape)
        tiles.write_tiled(target.depth, np.nan, self._observed)
        tiles.write_tiled(target.silhouette, 0, self._silhouette)
        clamped = np.minimum(target.depth, self._objective.clamp_depth, dtype=np.float64).sum()
        self._empty[:] = clamped, 0.0, np.count_nonzero(target.silhouette)
        c = target.camera
        self._camera[:] = c.fx, c.fy, c.cx, c.cy, 1 / c.fx, 1 / c.fy, c.width, c.height
        self._target = target

    def score(self, poses: ArrayLike) -> Array:
        return self._sums_and_energies(as_batch(poses))[1]

    def evaluate(self, poses: ArrayLike) -> Scores:
        sums, energies = self._sums_and_energies(as_batch(poses))
        return Scores(energies, 1 - silhouette_disagreement(sums[:, 1], sums[:, 2]))

    def terms(self, poses: ArrayLike) -> Terms:
        batch = as_batch(poses)
        clamped, matched_silhouette, union = self._sums_and_energies(batch)[0].T
        return Terms.of_sums(self._objective, batch, clamped, matched_silhouette, union)

    def render(self, pose: ArrayLike) -> Depth:
        shape, batch = self.target.camera.shape, as_batch(np.asarray(pose)[None])
        space = self._workspaces[0]
        kernel.draw_pose(batch[0], self._hand, self._camera, *space.arrays)
        inverse = tiles.read_tiled(space.buffer, shape)
        depth = np.divide(1, inverse, out=np.zeros_like(inverse), where=inverse > 0)
        space.buffer[:] = 0
        return depth

    def close(self) -> None:
        """End the threads; the scorer is unusable afterwards."""
        self._pool.shutdown()

    def _sums_and_energies(self, poses: Array) -> tuple[Array, Array]:
        height, width = self.target.camera.shape
        count = len(poses)
        if count > len(self._poses):
            self._allocate(count)
        self._poses[:count] = poses
        chunks = max(1, min(self._threads, count, count * height * width // _THREAD_PIXELS))
        bounds = [count * n // chunks for n in range(chunks + 1)]
        others = [self._pool.submit(self._score_chunk, n, bounds[n], bounds[n + 1]) for n in range(1, chunks)]
        self._score_chunk(0, bounds[0], bounds[1])
        for other in others:
            other.result()
        return self._sums[:count].copy(), self._energies[:count].copy()

    def _score_chunk(self, thread: int, start: int, stop: int) -> None:
        kernel.score_poses(
            self._poses,
            start,
            stop,
            self._hand,
            self._camera,
            self._observed,
            self._silhouette,
            self._empty,
            self._objective_constants,
            *self._workspaces[thread].arrays,
            self._sums,
            self._energies,
        )

    def _allocate(self, count: int) -> None:
        self._poses, self._sums, self._energies = np.empty((count, POSE_SIZE)), np.empty((count, 3)), np.empty(count)

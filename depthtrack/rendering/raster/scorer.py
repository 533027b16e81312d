"""The `raster` backend: writes the kernel's arrays, and divides a batch among threads."""

import weakref

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.errors import InputError
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.objective import Terms, add_posture_terms
from depthtrack.rendering.options import Objective
from depthtrack.rendering.raster import kernel, tiles
from depthtrack.rendering.raster.arrays import KernelArrays
from depthtrack.rendering.raster.hand_constants import hand_constants
from depthtrack.rendering.raster.work_queue.queue import new_tickets
from depthtrack.rendering.raster.work_queue.workers import Workers
from depthtrack.rendering.scorer import ScorerBase, Scores, as_batch
from depthtrack.rendering.target import Target
from depthtrack.types import Array, Depth

_SETUP_PIXELS = 11_000
"""Pixels that take as long to score as the set-up of a pose: 2.2 us, where 64 x 64 pixels take 0.8 us."""
_WAKE_PIXELS = 400_000
"""Pixels of a batch, set-up included, that justify a wake of idle workers: 80 us of work. A wake costs 30 to 60 us."""


class RasterScorer(ScorerBase):
    """CPU rasteriser; the number of threads does not change the energies.

    Up to `threads` threads share a batch. Each pose is scored by one thread. After a batch, the others poll for the
    next one for 0.2 to 0.4 ms, and then sleep. A single pose or a small batch wakes no thread.

    Raises:
        InputError: if `threads` is not within 1 to 256.
    """

    name = "raster"

    def __init__(self, shape: HandShape, objective: Objective | None = None, threads: int = 1) -> None:
        if not 1 <= threads <= 256:
            raise InputError(f"the rasteriser runs on 1 to 256 threads, found {threads}")
        self._objective = o = objective or Objective()
        self._threads, tickets = threads, new_tickets(threads)
        objective_constants = np.array(
            [
                o.match_depth,
                o.clamp_depth,
                o.depth_unit,
                o.epsilon,
                o.silhouette_weight,
                o.kinematic_weight,
                o.before_cost,
            ]
        )
        self._arrays = KernelArrays(hand_constants(shape), objective_constants, tickets)
        self._workers = Workers(tickets, threads, self._arrays.score_tickets)
        # The workers do not refer to the scorer, so a scorer that is not closed is collected, and ends them too.
        self._stop = weakref.finalize(self, self._workers.stop)

    def set_target(self, target: Target) -> None:
        shape, arrays = target.camera.shape, self._arrays
        self._workers.finish_batch()
        if self._target is None or self._target.camera.shape != shape:
            self._workers.wait_until_idle()
            arrays.allocate_images(shape, self._threads)
        tiles.write_tiled(target.depth, np.nan, arrays.observed)
        tiles.write_labels(target.silhouette, target.depth, arrays.labels)
        maps = target.hidden_from(self._objective.hidden_depth), target.seen_from(self._objective.surroundings_depth)
        arrays.is_hiding[0] = any(each.any() for each in maps)
        if arrays.is_hiding[0]:
            tiles.write_tiled(maps[0], 0, arrays.hidden_from)
            tiles.write_tiled(maps[1], 0, arrays.seen_from)
        clamped = np.minimum(target.depth, self._objective.clamp_depth, dtype=np.float64).sum()
        arrays.empty[:] = clamped, 0.0, np.count_nonzero(target.silhouette)
        c = target.camera
        arrays.camera[:] = c.fx, c.fy, c.cx, c.cy, 1 / c.fx, 1 / c.fy, c.width, c.height
        self._target = target

    def score(self, poses: ArrayLike) -> Array:
        return self.evaluate(poses).energy

    def evaluate(self, poses: ArrayLike) -> Scores:
        count = self._score(as_batch(poses))
        return Scores(self._arrays.energies[:count].copy(), self._arrays.agreements[:count].copy())

    def terms(self, poses: ArrayLike) -> Terms:
        batch = as_batch(poses)
        clamped, matched_silhouette, union = self._arrays.sums[: self._score(batch)].T.copy()
        return Terms.of_sums(self._objective, batch, clamped, matched_silhouette, union)

    def render(self, pose: ArrayLike) -> Depth:
        shape, batch = self.target.camera.shape, as_batch(np.asarray(pose)[None])
        arrays, space = self._arrays, self._arrays.workspaces[0]
        kernel.draw_pose(batch[0], arrays.hand, arrays.camera, *space.arrays)
        depth = tiles.read_depth(space.buffer, shape)
        space.buffer[:] = 0
        return depth

    def close(self) -> None:
        """End the threads; the scorer is unusable afterwards."""
        self._stop()
        self._workers.join()

    def _score(self, poses: Array) -> int:
        """Write sums, energies and agreements of poses (B, 27) to the arrays; return B."""
        height, width = self.target.camera.shape
        arrays, count = self._arrays, len(poses)
        self._workers.finish_batch()
        if count > len(arrays.poses):
            self._workers.wait_until_idle()
            arrays.allocate_poses(count)
        arrays.poses[:count] = poses
        self._workers.run(count, wake=count > 1 and count * (height * width + _SETUP_PIXELS) >= _WAKE_PIXELS)
        add_posture_terms(self._objective, arrays.poses[:count], arrays.energies[:count])
        return count

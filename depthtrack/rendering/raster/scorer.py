"""The `raster` backend: prepares arrays, shares a batch among threads."""

import time
import weakref
from dataclasses import dataclass, field
from functools import partial
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthtrack.errors import InputError
from depthtrack.hand.pose import POSE_SIZE
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.objective import Objective, Terms
from depthtrack.rendering.raster import kernel, layout, quadrics
from depthtrack.rendering.raster import tiles as tiles
from depthtrack.rendering.raster.work_queue.queue import Tickets, is_done, new_tickets, submit, tell_to_leave
from depthtrack.rendering.raster.work_queue.worker import Helper
from depthtrack.rendering.scorer import ScorerBase, as_batch
from depthtrack.rendering.target import Target
from depthtrack.types import Array, Array32, Depth, Index

_PATIENCE = 4000
"""Looks at an exhausted batch before a thread goes to sleep: some 0.2 ms, enough for a swarm to be moved."""


@dataclass
class _Workspace:
    """One thread's own arrays: see `kernel.score_poses`."""

    buffer: Depth
    first: Index
    last: Index
    low: Index
    high: Index
    scratch: Array = field(default_factory=lambda: np.zeros(4 * layout.LANES))
    table: Array32 = field(default_factory=lambda: np.zeros(quadrics.COEFFICIENT_ROWS * quadrics.SLOTS, np.float32))

    @classmethod
    def of(cls, shape: tuple[int, int]) -> Self:
        count, blocks = tiles.stripe_counts(shape)
        first, last = np.zeros((2, count + 1), np.int64)
        return cls(tiles.new_stripes(shape), first, last, np.full(count, blocks), np.full(count, -1))

    @property
    def arrays(self) -> tuple[NDArray[np.generic], ...]:
        return self.scratch, self.table, self.buffer, self.first, self.last, self.low, self.high


class RasterScorer(ScorerBase):
    """CPU rasteriser; `threads` share each batch, and the energies' bits do not depend on how many there are.

    Between batches that follow each other closely the threads beyond the first stay awake, and keep their cores busy.
    """

    name = "raster"

    def __init__(self, shape: HandShape, objective: Objective | None = None, threads: int = 1) -> None:
        if not 1 <= threads <= 256:
            raise InputError(f"the rasteriser runs on 1 to 256 threads, found {threads}")
        self._objective = o = objective or Objective()
        self._hand = layout.constants(shape)
        self._constants = np.array(
            [o.match_depth, o.clamp_depth, o.depth_unit, o.epsilon, o.skin_weight, o.kinematic_weight]
        )
        self._camera, self._empty = np.empty(8), np.empty(3)
        self._make_room(256)
        self._tickets = new_tickets(threads)
        # Threads know the scorer weakly, so that one that was forgotten rather than closed ends them too.
        self._helpers = [Helper(partial(_help, weakref.ref(self), n)) for n in range(1, threads)]
        self._dismiss = weakref.finalize(self, _dismiss, self._tickets, self._helpers)

    def set_target(self, target: Target) -> None:
        shape = target.camera.shape
        if self._target is None or self._target.camera.shape != shape:
            self._send_to_sleep()
            self._workspaces = [_Workspace.of(shape) for _ in range(len(self._helpers) + 1)]
            self._observed, self._skin = tiles.new_stripes(shape), tiles.new_stripes(shape)
        tiles.write_stripes(target.depth, np.nan, self._observed)
        tiles.write_stripes(target.skin, 0, self._skin)
        clamped = np.minimum(target.depth, self._objective.clamp_depth, dtype=np.float64).sum()
        self._empty[:] = clamped, 0.0, np.count_nonzero(target.skin)
        c = target.camera
        self._camera[:] = c.fx, c.fy, c.cx, c.cy, 1 / c.fx, 1 / c.fy, c.width, c.height
        self._target = target

    def score(self, poses: ArrayLike) -> Array:
        return self._sums_and_energies(as_batch(poses))[1]

    def terms(self, poses: ArrayLike) -> Terms:
        batch = as_batch(poses)
        clamped, matched_skin, union = self._sums_and_energies(batch)[0].T
        return Terms.of_sums(self._objective, batch, clamped, matched_skin, union)

    def render(self, pose: ArrayLike) -> Depth:
        shape, batch = self.target.camera.shape, as_batch(np.asarray(pose)[None])
        space = self._workspaces[0]
        kernel.draw_pose(batch[0], self._hand, self._camera, *space.arrays)
        inverse = tiles.read_stripes(space.buffer, shape)
        depth = np.divide(1, inverse, out=np.zeros_like(inverse), where=inverse > 0)
        space.buffer[:] = 0
        return depth

    def close(self) -> None:
        self._dismiss()

    def _sums_and_energies(self, poses: Array) -> tuple[Array, Array]:
        self.target  # noqa: B018 (raises before the first observation)
        count = len(poses)
        self._settle()
        if count > len(self._poses):
            self._send_to_sleep()
            self._make_room(count)
        self._poses[:count] = poses
        submit(self._tickets, count)
        if count > 1:
            for helper in self._helpers:
                helper.wake()
        # Each pose is scored whole by whichever thread takes it: the same bits for any number of them.
        self._work(0)
        self._settle()
        return self._sums[:count].copy(), self._energies[:count].copy()

    def _work(self, thread: int) -> None:
        kernel.score_poses(
            self._poses,
            self._tickets,
            thread,
            _PATIENCE,
            self._hand,
            self._camera,
            self._observed,
            self._skin,
            self._empty,
            self._constants,
            *self._workspaces[thread].arrays,
            self._sums,
            self._energies,
        )

    def _settle(self) -> None:
        """Wait for poses that other threads still have in hand."""
        while not is_done(self._tickets):
            time.sleep(0)

    def _send_to_sleep(self) -> None:
        """Have no other thread look at any array, so that they can be replaced."""
        tell_to_leave(self._tickets, True)
        while not all(helper.is_idle for helper in self._helpers):
            time.sleep(0)
        tell_to_leave(self._tickets, False)

    def _make_room(self, count: int) -> None:
        self._poses, self._sums, self._energies = np.empty((count, POSE_SIZE)), np.empty((count, 3)), np.empty(count)


def _help(scorer: "weakref.ref[RasterScorer]", thread: int) -> None:
    if (alive := scorer()) is not None:
        alive._work(thread)


def _dismiss(tickets: Tickets, helpers: list[Helper]) -> None:
    tell_to_leave(tickets, True)
    while helpers:
        helpers.pop().stop()

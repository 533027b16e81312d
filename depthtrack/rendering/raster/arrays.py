"""The arrays of the kernel: those that all threads share, and a workspace per thread."""

from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from depthtrack.hand.pose import POSE_SIZE
from depthtrack.rendering.raster import hand_constants as constants
from depthtrack.rendering.raster import kernel, quadrics, tiles
from depthtrack.rendering.raster.work_queue.queue import Tickets
from depthtrack.types import Array, Array32, Depth, Index


@dataclass
class Workspace:
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
        """Return the workspace for images (h, w)."""
        columns, rows = tiles.tile_counts(shape)
        first, last = np.zeros((2, columns + 1), np.int64)
        return cls(tiles.new_tiled_image(shape), first, last, np.full(columns, rows), np.full(columns, -1))

    @property
    def arrays(self) -> tuple[NDArray[np.generic], ...]:
        return self.scratch, self.table, self.buffer, self.first, self.last, self.low, self.high


class KernelArrays:
    """Arguments of `kernel.score_poses`; workers refer to them, and not to the scorer.

    hand: see `hand_constants`.
    objective: (7,) see `kernel.score_poses`.
    """

    def __init__(self, hand: Array, objective: Array, tickets: Tickets) -> None:
        self.hand, self.objective, self.tickets = hand, objective, tickets
        self.camera, self.empty, self.has_occluder = np.empty(8), np.empty(3), np.zeros(1, np.bool_)
        self.workspaces: list[Workspace] = []
        self.allocate_poses(256)

    def allocate_poses(self, count: int) -> None:
        """Allocate a batch of `count` poses (B, 27), with sums (B, 3), energies and agreements (B,)."""
        self.poses, self.sums = np.empty((count, POSE_SIZE)), np.empty((count, 3))
        self.energies, self.agreements = np.empty((2, count))

    def allocate_images(self, shape: tuple[int, int], threads: int) -> None:
        """Allocate the images (h, w) of the target, tiled, and the workspace of each thread."""
        self.workspaces = [Workspace.of(shape) for _ in range(threads)]
        self.observed, self.hidden_from = (tiles.new_tiled_image(shape) for _ in range(2))
        self.labels = np.zeros(len(self.observed) // tiles.TILE_PIXELS, np.int64)

    def score_tickets(self, thread: int, spin_limit: int) -> None:
        """Score poses of the batch in this thread until `queue.pop` returns -1."""
        kernel.score_poses(
            self.poses,
            self.tickets,
            thread,
            spin_limit,
            self.hand,
            self.camera,
            self.observed,
            self.labels,
            self.has_occluder,
            self.hidden_from,
            self.empty,
            self.objective,
            *self.workspaces[thread].arrays,
            self.sums,
            self.energies,
            self.agreements,
        )

"""The arrays of the kernel: those that all threads share, and a workspace per thread."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from depthtrack.hand.pose import POSE_SIZE
from depthtrack.rendering.raster import hand_constants as constants
from depthtrack.rendering.raster import kernel, quadrics, tiles
from depthtrack.rendering.raster.work_queue.queue import Tickets
from depthtrack.types import Array, Array32


@dataclass
class Workspace:
    """Arrays of one thread: see `kernel.score_poses`.

    memory: of the buffer, zeros.
    """

    memory: Array32
    scratch: Array = field(default_factory=lambda: np.zeros(4 * constants.LANES))
    table: Array32 = field(default_factory=lambda: np.zeros(quadrics.COEFFICIENT_ROWS * quadrics.SLOTS, np.float32))

    def fit_to(self, columns: int, rows: int) -> None:
        """Set the sizes of the arrays to those of an image of `columns` by `rows` tiles."""
        self.buffer = self.memory[: columns * rows * tiles.TILE_PIXELS]
        self.first, self.last = np.zeros((2, columns + 1), np.int64)
        self.low, self.high = np.full(columns, rows), np.full(columns, -1)

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
        self.camera, self.empty, self.is_hiding = np.empty(8), np.empty(3), np.zeros(1, np.bool_)
        self.workspaces: list[Workspace] = []
        self._capacity = 0
        self.allocate_poses(256)

    def allocate_poses(self, count: int) -> None:
        """Allocate a batch of `count` poses (B, 27), with sums (B, 3), energies and agreements (B,)."""
        self.poses, self.sums = np.empty((count, POSE_SIZE)), np.empty((count, 3))
        self.energies, self.agreements = np.empty((2, count))

    def allocate_images(self, shape: tuple[int, int], threads: int) -> None:
        """Allocate the images (h, w) of the target, tiled, and the workspace of each thread.

        The memory of larger images is used again.
        """
        columns, rows = tiles.tile_counts(shape)
        count = columns * rows
        if count > self._capacity:
            self._capacity = count + count // 4  # regions grow and shrink by a little
            self.workspaces = [Workspace(tiles.new_tiles(self._capacity)) for _ in range(threads)]
            self._images = [tiles.new_tiles(self._capacity) for _ in range(3)]
        for each in self.workspaces:
            each.fit_to(columns, rows)
        size = count * tiles.TILE_PIXELS
        self.observed, self.hidden_from, self.seen_from = (image[:size] for image in self._images)
        self.labels = np.zeros(count, np.int64)

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
            self.is_hiding,
            self.hidden_from,
            self.seen_from,
            self.empty,
            self.objective,
            *self.workspaces[thread].arrays,
            self.sums,
            self.energies,
            self.agreements,
        )

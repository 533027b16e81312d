"""The `raster` backend: prepares arrays, shares a batch among threads."""

from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthtrack.errors import InputError
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.objective import Objective, Terms
from depthtrack.rendering.raster import kernel, layout, quadrics, stripes
from depthtrack.rendering.raster.helper import Helper
from depthtrack.rendering.scorer import ScorerBase, as_batch
from depthtrack.rendering.target import Target

Array = NDArray[np.float64]


@dataclass
class _Workspace:
    """One thread's own arrays: see `kernel.score_poses`."""

    buffer: NDArray[np.float32]
    first: NDArray[np.int64]
    last: NDArray[np.int64]
    low: NDArray[np.int64]
    high: NDArray[np.int64]
    scratch: Array = field(default_factory=lambda: np.zeros(4 * layout.LANES))
    table: NDArray[np.float32] = field(
        default_factory=lambda: np.zeros(quadrics.COEFFICIENT_ROWS * quadrics.SLOTS, np.float32)
    )

    @classmethod
    def of(cls, shape: tuple[int, int]) -> Self:
        count, blocks = stripes.stripe_counts(shape)
        first, last = np.zeros((2, count + 1), np.int64)
        return cls(stripes.new_stripes(shape), first, last, np.full(count, blocks), np.full(count, -1))

    @property
    def arrays(self) -> tuple[NDArray[np.generic], ...]:
        return self.scratch, self.table, self.buffer, self.first, self.last, self.low, self.high


class RasterScorer(ScorerBase):
    """CPU rasteriser; `threads` share each batch, and the energies' bits do not depend on how many there are."""

    name = "raster"

    def __init__(self, shape: HandShape, objective: Objective | None = None, threads: int = 1) -> None:
        if not 1 <= threads <= 256:
            raise InputError(f"the rasteriser runs on 1 to 256 threads, found {threads}")
        self._objective = o = objective or Objective()
        self._hand = layout.constants(shape)
        self._constants = np.array(
            [o.match_depth, o.clamp_depth, o.depth_unit, o.epsilon, o.skin_weight, o.kinematic_weight]
        )
        self._counter = np.zeros(1, np.int64)
        self._helpers = [Helper() for _ in range(threads - 1)]

    def observe(self, target: Target) -> None:
        shape = target.camera.shape
        if self._target is None or self._target.camera.shape != shape:
            self._workspaces = [_Workspace.of(shape) for _ in range(len(self._helpers) + 1)]
            self._observed, self._skin = stripes.new_stripes(shape), stripes.new_stripes(shape)
        stripes.write_stripes(target.depth, np.nan, self._observed)
        stripes.write_stripes(target.skin, 0, self._skin)
        clamped = np.minimum(target.depth, self._objective.clamp_depth, dtype=np.float64).sum()
        self._empty = np.array([clamped, 0.0, np.count_nonzero(target.skin)])
        c = target.camera
        self._camera = np.array([c.fx, c.fy, c.cx, c.cy, 1 / c.fx, 1 / c.fy, c.width, c.height], np.float64)
        self._target = target

    def score(self, poses: ArrayLike) -> Array:
        return self._sums_and_energies(as_batch(poses))[1]

    def terms(self, poses: ArrayLike) -> Terms:
        batch = as_batch(poses)
        clamped, matched_skin, union = self._sums_and_energies(batch)[0].T
        return Terms.of_sums(self._objective, batch, clamped, matched_skin, union)

    def render(self, pose: ArrayLike) -> NDArray[np.float32]:
        batch, space = as_batch(np.asarray(pose)[None]), self._workspaces[0]
        kernel.draw_pose(batch[0], self._hand, self._camera, *space.arrays)
        inverse = stripes.read_stripes(space.buffer, self.target.camera.shape)
        depth = np.divide(1, inverse, out=np.zeros_like(inverse), where=inverse > 0)
        space.buffer[:] = 0
        return depth

    def close(self) -> None:
        for helper in self._helpers:
            helper.stop()
        self._helpers = []

    def _sums_and_energies(self, poses: Array) -> tuple[Array, Array]:
        self.target  # noqa: B018 (raises before the first observation)
        sums, energies = np.empty((len(poses), 3)), np.empty(len(poses))
        self._counter[0] = 0

        def work(space: _Workspace) -> None:
            kernel.score_poses(
                poses,
                self._counter,
                self._hand,
                self._camera,
                self._observed,
                self._skin,
                self._empty,
                self._constants,
                *space.arrays,
                sums,
                energies,
            )

        # Each pose is scored whole by whichever thread is free: the same bits for any number of them.
        for helper, space in zip(self._helpers, self._workspaces[1:], strict=True):
            helper.start(work, space)
        work(self._workspaces[0])
        for helper in self._helpers:
            helper.wait()
        return sums, energies

"""The scorer: one protocol for every backend that renders hypotheses and compares them with an observation."""

from types import TracebackType
from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.hand.pose import POSE_SIZE
from depthtrack.rendering.objective import Terms
from depthtrack.rendering.target import Target
from depthtrack.types import Array, Depth


class Scores(NamedTuple):
    """What a tracker needs of scored poses.

    energy: (B,) energies of Eq. (1).
    agreement: (B,) agreement of rendered and observed silhouette, 0 to 1: 1 minus the silhouette term of Eq. (2).
    """

    energy: Array
    agreement: Array


class Scorer(Protocol):
    """Scores hand hypotheses against one observation at a time (Oikonomidis et al. 2011, Sec. 2.3).

    Poses are (B, 27); depth is metres. Only faces seen from outside are drawn, from `rendered_surface.NEAR` onward: a
    primitive that holds the lens shows nothing. Backends agree with `oracle` and give the same bits for any
    number of threads. A scorer is used by one thread at a time and closed when done (or used in a `with`).
    """

    name: str

    @property
    def target(self) -> Target:
        """The observation last set by `set_target`. Raises RuntimeError before that."""
        ...

    def set_target(self, target: Target) -> None:
        """Set what the next calls score against; its camera is the one hypotheses are seen with."""
        ...

    def score(self, poses: ArrayLike) -> Array:
        """Energies (B,) of Eq. (1)."""
        ...

    def evaluate(self, poses: ArrayLike) -> Scores:
        """Return the energies of `score` with the agreement of the silhouettes."""
        ...

    def terms(self, poses: ArrayLike) -> Terms:
        """Energies with the separate terms of Eq. (1) and (2)."""
        ...

    def render(self, pose: ArrayLike) -> Depth:
        """Depth (h, w) of one hypothesis through the observation's camera, 0 where there is no hand."""
        ...

    def close(self) -> None:
        """Free what the backend holds; the scorer cannot be used after."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


class ScorerBase:
    """What backends share: closing by `with`, and the check of poses."""

    _target: Target | None = None

    def close(self) -> None:
        """Nothing to free unless a backend says otherwise."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def terms(self, poses: ArrayLike) -> Terms:
        raise NotImplementedError

    def evaluate(self, poses: ArrayLike) -> Scores:
        """Return the energies with the agreement of the silhouettes."""
        terms = self.terms(poses)
        return Scores(terms.energy, 1 - terms.silhouette)

    @property
    def target(self) -> Target:
        """The observation set by `set_target`. Raises RuntimeError before that."""
        if self._target is None:
            raise RuntimeError("call set_target(target) before scoring or rendering")
        return self._target


def as_batch(poses: ArrayLike) -> Array:
    """Poses as a contiguous (B, 27) float64 array. Raises ValueError for any other shape or non-finite numbers."""
    batch = np.ascontiguousarray(poses, dtype=np.float64)
    if batch.ndim != 2 or batch.shape[1] != POSE_SIZE:
        raise ValueError(f"poses must be (B, {POSE_SIZE}), found {batch.shape}")
    if not np.all(np.isfinite(batch)):
        raise ValueError("poses must be finite numbers")
    return batch

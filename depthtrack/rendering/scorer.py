"""The scorer protocol of all backends that render hypotheses and compare them with a target."""

import math
from types import TracebackType
from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.closing import Closing
from depthtrack.hand.pose import POSE_SIZE
from depthtrack.rendering.objective import Terms
from depthtrack.rendering.target import Target
from depthtrack.types import Array, Depth


class Scores(NamedTuple):
    """Energies and silhouette agreements of scored poses.

    energy: (B,) of Eq. (1).
    agreement: (B,) 0 to 1: 1 minus the silhouette term of Eq. (2).
    """

    energy: Array
    agreement: Array


class Scorer(Protocol):
    """Scores hand hypotheses against one target at a time (Oikonomidis et al. 2011, Sec. 2.3).

    Poses are (B, 27): metres, quaternion, radians, camera frame. Only faces visible from outside and beyond
    `rendered_surface.NEAR` are drawn, so a primitive around the optical centre is invisible. Backends agree with
    `oracle` and give the same bits for any number of threads. Use a scorer in one thread at a time, and close it or use
    it in a `with`.
    """

    name: str

    @property
    def target(self) -> Target:
        """The target of the last `set_target`.

        Raises:
            RuntimeError: if no target was set.
        """
        ...

    def set_target(self, target: Target) -> None:
        """Set the target of the next calls; its camera renders the hypotheses."""
        ...

    def score(self, poses: ArrayLike) -> Array:
        """Return the energies (B,) of Eq. (1) of poses (B, 27)."""
        ...

    def evaluate(self, poses: ArrayLike) -> Scores:
        """Return the energies of poses (B, 27) with the agreement of the silhouettes."""
        ...

    def terms(self, poses: ArrayLike) -> Terms:
        """Return the energies of poses (B, 27) with the terms of Eq. (1) and (2)."""
        ...

    def render(self, pose: ArrayLike) -> Depth:
        """Return the depth (h, w), metres, of a pose (27,) for the target's camera; 0 = no hand."""
        ...

    def close(self) -> None:
        """Free the backend's resources; the scorer is unusable afterwards."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


class ScorerBase(Closing):
    """Base of the backends: the target, and closing by `with`."""

    _target: Target | None = None

    def close(self) -> None:
        """Do nothing; a backend with resources overrides it."""

    def terms(self, poses: ArrayLike) -> Terms:
        raise NotImplementedError

    def evaluate(self, poses: ArrayLike) -> Scores:
        """Return the energies of poses (B, 27) with the agreement of the silhouettes."""
        terms = self.terms(poses)
        return Scores(terms.energy, terms.agreement)

    @property
    def target(self) -> Target:
        """The target of the last `set_target`; see `Scorer`."""
        if self._target is None:
            raise RuntimeError("call set_target(target) before scoring or rendering")
        return self._target


def as_batch(poses: ArrayLike) -> Array:
    """Return poses as a contiguous (B, 27) float64 array.

    Raises:
        ValueError: if the shape differs or a number is not finite.
    """
    batch = np.ascontiguousarray(poses, dtype=np.float64)
    if batch.ndim != 2 or batch.shape[1] != POSE_SIZE:
        raise ValueError(f"poses must be (B, {POSE_SIZE}), found {batch.shape}")
    # Numbers add to a finite one unless one is not finite, or huge. A product would wake the threads of a BLAS.
    if not math.isfinite(batch.sum()) and not np.isfinite(batch).all():
        raise ValueError("poses must be finite numbers")
    return batch

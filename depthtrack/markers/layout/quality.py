"""Quality of a marker layout: the objectives that a search minimises."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np

from depthtrack.hand.synergies import Synergies
from depthtrack.markers.layout.candidates import Candidates
from depthtrack.markers.layout.conditioning import Conditioning, conditions_of, grown_conditions
from depthtrack.markers.layout.key_frames import key_frames
from depthtrack.markers.layout.options import QualityOptions
from depthtrack.markers.layout.placement import Placement, least_distance, mean_hidden, placement_energies
from depthtrack.markers.layout.posterior import Posterior, errors_of, grown_errors
from depthtrack.markers.layout.sharing import share_rows
from depthtrack.markers.layout.tables import conditioning_of, placement_of, posterior_of
from depthtrack.types import Array, Index


class Terms(NamedTuple):
    """Terms of the objectives of a layout.

    energy: E of the chosen objective.
    error: expected root mean square error, metres. error_lost: after the loss of the marker that raises it most.
    condition: E_cond, the mean condition number over the key-frames, Eq. (8). condition_lost: likewise.
    distance: least distance between two markers in any key-frame, metres, the root of Eq. (6).
    occlusion: share of the samples that too few cameras see; 0 without cameras.
    """

    energy: float
    error: float
    error_lost: float
    condition: float
    condition_lost: float
    distance: float
    occlusion: float


@dataclass(frozen=True, eq=False)
class LayoutQuality:
    """The objectives for layouts of candidates, precomputed for a set of postures.

    synergies: of the postures, all components; the subspace has the first l = `options.components`.
    postures: (F, 20) of the key-frames, rad.
    """

    candidates: Candidates
    synergies: Synergies
    postures: Array
    options: QualityOptions
    placement: Placement
    conditioning: Conditioning
    posterior: Posterior

    @classmethod
    def of(
        cls,
        candidates: Candidates,
        postures: Array,
        options: QualityOptions | None = None,
        synergies: Synergies | None = None,
        noise: Array | None = None,
    ) -> Self:
        """Return the objectives for postures (N, 20), rad.

        synergies: those of the postures if None.
        noise: (V,) standard deviation of a coordinate of each candidate, metres; that of the options if None.

        Raises:
            InputError: if the postures are equal.
        """
        options = options or QualityOptions()
        fitted = Synergies.fit(postures) if synergies is None else synergies
        options = replace(options, components=min(options.components, len(fitted)))
        subspace = fitted.truncated(options.components)
        chosen = postures[key_frames(postures, options.key_frames)]
        each = np.full(len(candidates), options.expected.residual) if noise is None else noise
        return cls(
            candidates,
            fitted,
            chosen,
            options,
            placement_of(candidates, chosen, options),
            conditioning_of(candidates, chosen, subspace, options),
            posterior_of(candidates, chosen, fitted, options, each),
        )

    @property
    def fewest(self) -> int:
        """Fewest markers of a layout.

        Their coordinates are as many as the parameters of the subspace, or they are three points with the wrist.
        """
        parameters = self.conditioning.size if self.options.objective == "condition" else 3
        parameters += 0 if self.options.anchored else 3
        return max(-(-parameters // 3), 2 if self.options.anchored else 3) + int(self.options.robust)

    def with_occlusion(self, hidden: Array) -> Self:
        """Return the objectives with the share (V,) of the samples that too few cameras see.

        For the expected error, a marker that is seen in half of the samples is half a measurement.
        """
        hidden = np.array(hidden, dtype=np.float64)
        return replace(
            self,
            placement=self.placement._replace(hidden=hidden),
            posterior=self.posterior._replace(precision=self.posterior.precision * np.maximum(1 - hidden, 1e-3)),
        )

    def energies(self, layouts: Index, bounds: Array | None = None, pool: ThreadPoolExecutor | None = None) -> Array:
        """Return E (N,) of layouts (N, K) of candidates.

        bounds: (N,) energies from which a layout is of no interest; it may then have infinity.
        pool: threads to share the layouts.
        """
        layouts = np.ascontiguousarray(layouts, dtype=np.int64)
        limits = np.full(len(layouts), np.inf) if bounds is None else bounds
        out = np.empty(len(layouts))

        def work(part: slice) -> None:
            placed, found = np.empty(len(layouts[part])), np.empty(len(layouts[part]))
            placement_energies(layouts[part], self.placement, placed)
            worst = np.full(len(placed), -np.inf)
            for some in self._judged(layouts[part]):
                self._measure(some, limits[part] - placed, found)
                np.maximum(worst, found, out=worst)
            out[part] = placed + worst

        share_rows(pool, len(layouts), work)
        return out

    def grown(self, base: Index, bound: float = np.inf, pool: ThreadPoolExecutor | None = None) -> Array:
        """Return E (V,) of the layout `base` (K,) with each of the candidates added.

        bound: energy from which a layout is of no interest; it may then have infinity.
        """
        base = np.ascontiguousarray(base, dtype=np.int64)
        count, placed = len(self.candidates), np.empty(len(self.candidates))
        layouts = np.column_stack([np.broadcast_to(base, (count, len(base))), np.arange(count)])
        placement_energies(layouts, self.placement, placed)
        worst = self._grown(base, bound - placed, pool)
        if self.options.robust:
            lost = np.empty(1)
            self._measure(base[None], np.full(1, np.inf), lost)
            np.maximum(worst, lost[0], out=worst)
            for k in range(len(base)):
                np.maximum(worst, self._grown(np.delete(base, k), bound - placed, pool), out=worst)
        worst[base] = np.inf
        return placed + worst

    def terms(self, layout: Index) -> Terms:
        """Return the terms of a layout (K,) of candidates."""
        rows = np.ascontiguousarray(layout, dtype=np.int64)
        energy, endless = float(self.energies(rows[None])[0]), np.full(1, np.inf)

        def measured(measure: Callable[[Index, Array], None]) -> tuple[float, float]:
            each = np.empty(1 + len(rows))
            measure(rows[None], each[:1])
            for k in range(len(rows)):
                measure(np.delete(rows, k)[None], each[k + 1 : k + 2])
            return float(each[0]), float(each.max())

        errors = measured(lambda some, out: errors_of(some, self.posterior, endless, out))
        shares = self.conditioning.shares
        plain = self.conditioning._replace(shares=shares / shares.sum())
        conditions = measured(lambda some, out: conditions_of(some, plain, endless, out))
        return Terms(
            energy,
            errors[0] / 1000,
            errors[1] / 1000,
            *conditions,
            least_distance(rows, self.placement) * self.placement.length,
            mean_hidden(rows, self.placement),
        )

    def _judged(self, layouts: Index) -> list[Index]:
        """Return the layouts (N, K); also those without one marker if they must be robust."""
        lost = range(layouts.shape[1]) if self.options.robust else ()
        return [layouts, *(np.ascontiguousarray(np.delete(layouts, k, axis=1)) for k in lost)]

    def _measure(self, layouts: Index, bounds: Array, out: Array) -> None:
        if self.options.objective == "condition":
            conditions_of(layouts, self.conditioning, bounds, out)
        else:
            errors_of(layouts, self.posterior, bounds, out)

    def _grown(self, base: Index, bounds: Array, pool: ThreadPoolExecutor | None) -> Array:
        count = len(self.candidates)
        if self.options.objective == "condition":
            every, out = np.arange(count), np.empty(count)
            share_rows(
                pool,
                count,
                lambda part: grown_conditions(base, every[part], self.conditioning, bounds[part], out[part]),
            )
            return out
        frames = np.arange(len(self.postures))
        squares = np.empty((len(frames), count))
        share_rows(pool, len(frames), lambda part: grown_errors(base, frames[part], self.posterior, squares))
        return np.asarray(np.sqrt(squares.mean(axis=0)))

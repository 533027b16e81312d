"""Quality of a marker layout (Schroeder et al. 2015, Sec. 4 and 5.1)."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np

from depthtrack.errors import InputError
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.hand.synergies import Synergies
from depthtrack.markers.layout.candidates import Candidates
from depthtrack.markers.layout.energy import Tables, layout_energies, layout_terms
from depthtrack.markers.layout.key_frames import key_frames
from depthtrack.markers.layout.options import QualityOptions
from depthtrack.markers.layout.sharing import share_rows
from depthtrack.types import Array, Index


class Terms(NamedTuple):
    """Terms of the objective of a layout.

    energy: E of Eq. (7), with the occlusion.
    condition: E_cond, the mean condition number over the key-frames, Eq. (8).
    lost: the same after the loss of the marker that raises it most.
    distance: least distance between two markers in any key-frame, metres, the root of Eq. (6).
    occlusion: share of the samples that too few cameras see; 0 without cameras.
    """

    energy: float
    condition: float
    lost: float
    distance: float
    occlusion: float


@dataclass(frozen=True, eq=False)
class LayoutQuality:
    """The objective for layouts of candidates, precomputed for a set of postures.

    synergies: of the subspace, l components.
    postures: (F, 20) of the key-frames, rad.
    tables: what the compiled objective reads.
    """

    candidates: Candidates
    synergies: Synergies
    postures: Array
    options: QualityOptions
    tables: Tables

    @classmethod
    def of(
        cls,
        candidates: Candidates,
        postures: Array,
        options: QualityOptions | None = None,
        synergies: Synergies | None = None,
    ) -> Self:
        """Return the objective for postures (N, 20), rad.

        synergies: of the subspace; those of the postures if None.

        Raises:
            InputError: if the postures are equal, or there are fewer synergies than asked for.
        """
        options = options or QualityOptions()
        fitted = Synergies.fit(postures) if synergies is None else synergies
        kept = fitted.truncated(min(options.components, len(fitted)))
        chosen = postures[key_frames(postures, options.key_frames)]
        return cls(candidates, kept, chosen, options, _tables(candidates, kept, chosen, options))

    @property
    def fewest(self) -> int:
        """Number of markers whose coordinates are as many as the parameters, at least."""
        parameters = self.tables.size + (0 if self.options.anchored else 3)
        return -(-parameters // 3) + int(self.options.robust)

    def with_occlusion(self, hidden: Array) -> Self:
        """Return the objective with the hidden share (V,) of each candidate, see `Tables`."""
        return replace(self, tables=self.tables._replace(hidden=np.array(hidden, dtype=np.float64)))

    def energies(self, layouts: Index, bounds: Array | None = None, pool: ThreadPoolExecutor | None = None) -> Array:
        """Return E (N,) of layouts (N, K) of candidates, Eq. (7).

        bounds: (N,) energies from which a layout is of no interest; it may then have infinity.
        pool: threads to share the layouts.
        """
        layouts = np.ascontiguousarray(layouts, dtype=np.int64)
        limits = np.full(len(layouts), np.inf) if bounds is None else bounds
        out = np.empty(len(layouts))

        def work(part: slice) -> None:
            layout_energies(layouts[part], self.tables, limits[part], out[part])

        share_rows(pool, len(layouts), work)
        return out

    def terms(self, layout: Index) -> Terms:
        """Return the terms of a layout (K,) of candidates."""
        rows = np.ascontiguousarray(layout, dtype=np.int64)
        condition, lost, distance, occlusion = layout_terms(rows, self.tables)
        energy = float(self.energies(rows[None])[0])
        return Terms(energy, condition, lost, distance * self.tables.length, occlusion)


def _tables(candidates: Candidates, synergies: Synergies, postures: Array, options: QualityOptions) -> Tables:
    """Return the products of the vertex Jacobians, and the distances over all key-frames."""
    model = HandModel(candidates.hand)
    poses = make_pose(np.zeros(3), [1.0, 0, 0, 0], postures)
    points = model.transform_points(poses, candidates.bodies, candidates.offsets)
    J = model.point_jacobian(poses, candidates.bodies, points)
    # The hand turns about the anchor at the wrist, which keeps its place.
    wrist = model.point_jacobian(poses, [0], model.wrist(poses)[:, None])
    turned = J[..., 3:6] - wrist[..., 3:6]
    J_pc = np.concatenate([turned, J[..., 6:] @ synergies.components], axis=-1)
    n = J_pc.shape[-1]
    if n > 23:
        raise InputError(f"a layout has at most 20 synergies, found {n - 3}")
    low = np.tril_indices(n)
    products = np.einsum("fvcp,fvcp->fvp", J_pc[..., low[0]], J_pc[..., low[1]])
    flat = np.moveaxis(points, 1, 0)
    squares = np.stack([np.min(np.sum((flat - one) ** 2, axis=-1), axis=1) for one in flat])
    # The length L of the flat hand from the wrist to the farthest fingertip.
    flat_hand = model.endpoints(make_pose(np.zeros(3), [1.0, 0, 0, 0], np.zeros(20)))
    length = float(np.linalg.norm(flat_hand - candidates.hand.wrist, axis=-1).max())
    return Tables(
        products=np.ascontiguousarray(products),
        sums=np.ascontiguousarray(J_pc.reshape(len(postures), len(candidates), 3 * n)),
        squares=squares / length**2,
        hidden=np.zeros(len(candidates)),
        size=n,
        length=length,
        condition_weight=options.condition_weight,
        distance_weight=options.distance_weight,
        occlusion_weight=options.occlusion_weight,
        anchored=options.anchored,
        robust=options.robust,
    )

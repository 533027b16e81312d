"""The sums of Oikonomidis et al. 2011, Eq. (2), over the seen part of a hand.

`objective.evaluate` of the depth map that `Target.unhidden` returns gives the same sums.
"""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.types import Array, Depth, Mask


@compiled(nogil=True)
def seen_sums(
    rendered: Depth,
    silhouette: Mask,
    observed: Depth,
    hiding: Depth,
    occluder: Depth,
    limits: tuple[float, float, float, float],
    out: Array,
) -> bool:
    """Write the sums of one rendered depth map, and return whether any of it is hidden.

    rendered, observed: (h, w) metres, 0 for none.
    silhouette: (h, w) o_s.
    hiding: (h, w) see `Target.hiding`.
    occluder: (h, w) see `Target.occluder`; all 0 without one.
    limits: d_m, d_M, metres; `Objective.before_cost`; depth behind `hiding` from which on a surface is hidden, metres.
    out: (3,) output: clamped, matched and union of `objective.evaluate`.
    """
    match_depth, clamp_depth, before_cost, behind = limits
    clamped, matched_silhouette, union, any_hidden = 0.0, 0.0, 0.0, False
    for v in range(rendered.shape[0]):
        for u in range(rendered.shape[1]):
            drawn, before = rendered[v, u], 0.0
            if drawn > 0:
                if occluder[v, u] > 0 and np.float64(drawn) < np.float64(occluder[v, u]) + behind:
                    before = before_cost
                elif hiding[v, u] > 0 and drawn >= hiding[v, u] + np.float32(behind):
                    drawn, any_hidden = np.float32(0), True
            r, o, s = np.float64(drawn), np.float64(observed[v, u]), silhouette[v, u]
            difference = abs(o - r)
            matched = r > 0 and (difference < match_depth or o == 0)
            clamped += min(difference, clamp_depth) + before * clamp_depth
            if s or matched:
                union += 1
            if s and matched:
                matched_silhouette += 1
            if not s:
                union += before
    out[0], out[1], out[2] = clamped, matched_silhouette, union
    return any_hidden

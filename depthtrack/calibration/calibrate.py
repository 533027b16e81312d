"""The sizes of a hand from a recording of it: whose side and about how large, then every finger.

Poses are searched in a few telling frames with hands of several sizes, the better one leads to its scale, and from
there poses and all sizes are fitted together. The poses are then looked for again with the hand that was found, for
some of the first ones were wrong, and fitted once more.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from depthtrack.calibration.joint_optimisation import JointFit, fit_jointly
from depthtrack.calibration.parameters import COUNT, LENGTHS, PALM, SCALE, hand_of, measures, prior_covariance
from depthtrack.calibration.pose_search import (
    FIRST,
    GOOD_VIEWS,
    SURE_MARGIN,
    TRIED_SCALES,
    Found,
    PoseSearcher,
    Progress,
)
from depthtrack.files import compact_json
from depthtrack.hand.shape import HandShape, Side
from depthtrack.segmentation.observation import Observation
from depthtrack.types import Array

VIEWS = 16
"""Frames that sizes are measured on."""
_LIKELY, _CROSSED = 6, 6
"""Poses of each of those frames that get sizes of their own, and sizes that are tried on the other frames."""


@dataclass(frozen=True)
class Measured:
    """One length or width: `mm`, its standard deviation `sigma_mm`, and `confidence` from 0, as little as before the
    recording was seen, to 1, all that can be known within the model."""

    mm: float
    sigma_mm: float
    confidence: float


@dataclass(frozen=True)
class Calibration:
    """`hand`, what is known of its sizes in `measured`, how much better its side explains the views than the other
    (`side_margin`, a share of the energy; None where the side was given), and how far the observed points are from the
    skin, mm: the average hand's at its best (`before_mm`), and this one's (`after_mm`).

    `observations` are the views, `poses` (V, 27) those of `hand` in them, `poses_before` those of the average hand.
    """

    hand: HandShape
    measured: dict[str, Measured]
    side_margin: float | None
    before_mm: float
    after_mm: float
    observations: tuple[Observation, ...]
    poses: Array
    poses_before: Array

    @property
    def side_sure(self) -> bool:
        """Whether the side was given, or the other one fits clearly worse."""
        return self.side_margin is None or self.side_margin >= SURE_MARGIN

    def to_json(self) -> str:
        """Return the text of `hand.json` with size, standard deviation and confidence of each parameter added."""
        measured = {
            name: {"mm": round(m.mm, 2), "sigma_mm": round(m.sigma_mm, 2), "confidence": round(m.confidence, 2)}
            for name, m in self.measured.items()
        }
        return compact_json({**self.hand.to_fields(), "measured": measured})


def calibrate(
    observations: Sequence[Observation],
    side: Side | None = None,
    seed: int = 0,
    threads: int = 1,
    source: str = "calibrated",
    progress: Progress | None = None,
) -> Calibration:
    """Measure the hand seen in `observations` (see `views.choose_views`), of which the first show it most open.

    Tells `progress` what is being done, and the share of the whole that is. The same observations and seed give the
    same hand for any number of threads. Raises InputError where what is seen does not look like a hand.
    """
    tell = progress or (lambda what, share: None)
    searcher = PoseSearcher(list(observations), seed, threads)
    sides: tuple[Side, ...] = ("right", "left") if side is None else (side,)
    begun = {}
    for n, tried in enumerate(sides):
        tell(f"a {tried} hand of what size?", 0.4 * n / len(sides))
        begun[tried] = _initialise(searcher, tried)
    chosen = min(sides, key=lambda s: begun[s][1].energies.mean())
    values, found = begun[chosen]
    found.check_hand()
    before = _refined(searcher, found.poses, np.zeros(COUNT), chosen)
    tell("fingers and palm", 0.5)
    views, first = searcher.views, found.best(GOOD_VIEWS)
    fit = fit_jointly([views[i] for i in first], found.poses[first], values, chosen, rounds=8)
    tell("the same with better poses", 0.7)
    found = searcher.improve(hand_of(fit.values, chosen), found.poses)
    good = found.best(GOOD_VIEWS)
    fit = fit_jointly([views[i] for i in good], found.poses[good], fit.values, chosen, rounds=6)
    tell("how sure is it?", 0.95)
    fit = fit_jointly([views[i] for i in good], fit.poses, fit.values, chosen, rounds=4, exact=True)
    values = with_usual_proportions(fit.values)
    after = _refined(searcher, found.poses, values, chosen)
    energies = {s: float(begun[s][1].energies.mean()) for s in sides}
    margin = None if side is not None else max(energies.values()) / min(energies.values()) - 1
    tell("done", 1.0)
    return Calibration(
        hand_of(values, chosen, source),
        _measured(values, fit.covariance),
        margin,
        1000 * float(np.median(before.distances[good])),
        1000 * float(np.median(after.distances[good])),
        tuple(searcher.observations[i] for i in good),
        after.poses[good],
        before.poses[good],
    )


def _initialise(searcher: PoseSearcher, side: Side) -> tuple[Array, Found]:
    """Sizes (35,) that a few open hands tell, and the poses of such a hand in all views.

    A hand of wrong sizes explains a view best in a wrong pose, one finger taken for the next. So each likely pose gets
    the sizes that suit it, and sizes are judged by how well they explain the other views.
    """
    first = searcher.views[:FIRST]
    likely: list[list[tuple[float, Array, float]]] = [[] for _ in first]
    for scale in TRIED_SCALES:
        for n, (poses, energies) in enumerate(searcher.candidates(HandShape(side=side, scale=scale), len(first))):
            likely[n] += [(float(e), pose, scale) for pose, e in zip(poses, energies, strict=True)]
    hands: list[tuple[float, Array]] = []
    for n, view in enumerate(first):
        for _, pose, scale in sorted(likely[n], key=lambda entry: entry[0])[:_LIKELY]:
            values = np.zeros(COUNT)
            values[SCALE] = np.log(scale)
            fit = fit_jointly([view], pose[None], values, side, rounds=6)
            hands.append((searcher.energy(hand_of(fit.values, side), n, fit.poses[0]), fit.values))
    tried = [values for _, values in sorted(hands, key=lambda entry: entry[0])[:_CROSSED]]
    found = [searcher.find(hand_of(values, side), len(first)) for values in tried]
    best = min(range(len(tried)), key=lambda k: found[k].energies.mean())
    fit = fit_jointly(first, found[best].poses, tried[best], side, rounds=6)
    return fit.values, searcher.find(hand_of(fit.values, side), attempts=2)


def _refined(searcher: PoseSearcher, poses: Array, values: Array, side: Side) -> JointFit:
    """The poses that bring a hand of given sizes closest to each view."""
    return fit_jointly(searcher.views, poses, values, side, rounds=8, free=slice(0, 0))


def with_usual_proportions(values: Array) -> Array:
    """The same hand with as much of its sizes as possible in its scale: the median factor of fingers and palm."""
    parts = np.append(values[LENGTHS].reshape(5, 3).mean(axis=1), values[PALM][:2])
    common = float(np.median(parts))
    out = values.copy()
    out[0] += common
    out[1:24] -= common  # lengths, widths and palm
    out[24:] /= np.exp(common)
    # The palm's factors do not move the thumb's base out of the palm, its offset has to.
    height = HandShape().bases[0, 2]
    out[-1] += height / np.exp(common) - height
    return out


def _measured(values: Array, covariance: Array) -> dict[str, Measured]:
    """What people ask for, with its standard deviation, and the share of the prior variance that the views removed."""
    prior = prior_covariance()
    table = {}
    for name, (metres, gradient) in measures(values).items():
        variance, before = float(gradient @ covariance @ gradient), float(gradient @ prior @ gradient)
        mm = 1000 * metres
        table[name] = Measured(mm, mm * np.sqrt(variance), 1 - variance / before)
    return table


def summary(calibration: Calibration) -> dict[str, Any]:
    """What `depthtrack calibrate` tells of a calibration: plain numbers."""
    return {
        "side": calibration.hand.side,
        "side_margin": calibration.side_margin,
        "side_sure": calibration.side_sure,
        "scale": calibration.hand.scale,
        "views": len(calibration.observations),
        "distance_before_mm": calibration.before_mm,
        "distance_after_mm": calibration.after_mm,
        "measured": {name: vars(m) for name, m in calibration.measured.items()},
    }

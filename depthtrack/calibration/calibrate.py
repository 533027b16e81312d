"""Calibration of a hand of one side from views: scale, and sizes of fingers and palm.

Poses are searched in a few views with hands of several scales, and the best scale is kept. From there poses and all
sizes are optimised jointly. The poses are then searched again with the hand that was found, since some of the first
ones were wrong, and optimised once more.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from depthtrack.calibration.joint_optimisation import JointFit, fit_jointly
from depthtrack.calibration.options import CalibrationOptions
from depthtrack.calibration.parameters import COUNT, LENGTHS, PALM, SCALE, hand_of, measures, prior_covariance
from depthtrack.calibration.pose_search import Found, PoseSearcher, Progress, ScorerFactory
from depthtrack.files import compact_json
from depthtrack.hand.shape import HandShape, Side
from depthtrack.segmentation.observation import Observation
from depthtrack.types import Array, Index


@dataclass(frozen=True)
class Measured:
    """One length or width in mm, with its standard deviation.

    confidence: share of the prior variance that the views removed: 0 for an unseen size, 1 for an exact one.
    """

    mm: float
    sigma_mm: float
    confidence: float


@dataclass(frozen=True)
class Calibration:
    """Calibrated hand and the quality of its fit.

    measured: each length and width by name.
    side_margin: share by which the other side costs more, see `sides`; None if only one side was calibrated.
    before_mm, after_mm: median distance of the observed points to the skin, of the average hand at its best and of this
        hand.
    observations: the views.
    poses: (V, 27) of `hand` in them.
    poses_before: (V, 27) of the average hand.
    sure_margin: margin from which on the side is sure.
    """

    hand: HandShape
    measured: dict[str, Measured]
    side_margin: float | None
    before_mm: float
    after_mm: float
    observations: tuple[Observation, ...]
    poses: Array
    poses_before: Array
    sure_margin: float = CalibrationOptions.sure_margin

    @property
    def side_sure(self) -> bool:
        """Whether the side was given, or the other one fits clearly worse."""
        return self.side_margin is None or self.side_margin >= self.sure_margin

    def to_json(self) -> str:
        """Return the text of `hand.json`, with the measured sizes and their uncertainty."""
        measured = {
            name: {"mm": round(m.mm, 2), "sigma_mm": round(m.sigma_mm, 2), "confidence": round(m.confidence, 2)}
            for name, m in self.measured.items()
        }
        return compact_json({**self.hand.to_fields(), "measured": measured})


def calibrate(
    observations: Sequence[Observation],
    scorer: ScorerFactory,
    side: Side = "right",
    seed: int = 0,
    source: str = "calibrated",
    progress: Progress | None = None,
    options: CalibrationOptions | None = None,
) -> Calibration:
    """Return the calibration of the hand in observations.

    observations: most open hands first, see `views.choose_views`.
    scorer: makes the scorer of a hand.
    progress: called with a description of the current stage, and the completed share.

    Equal observations, seed and energies give an equal hand.

    Raises:
        InputError: if the observations do not resemble a hand.
    """
    report = progress or (lambda stage, share: None)
    options = options or CalibrationOptions()
    searcher = PoseSearcher(list(observations), scorer, seed, options)
    report(f"scale of a {side} hand", 0.0)
    values, found = _initialise(searcher, side)
    found.check_hand(options.hand_like)
    before = _refined(searcher, found.poses, np.zeros(COUNT), side)
    views, joint = searcher.views, options.joint

    def fit(chosen_views: Index, poses: Array, values: Array, iterations: int, exact: bool = False) -> JointFit:
        picked = [views[i] for i in chosen_views]
        return fit_jointly(picked, poses, values, side, iterations, exact=exact, options=joint)

    report("fingers and palm", 0.6)
    first = found.best(options.good_views)
    fitted = fit(first, found.poses[first], values, 8)
    report("fingers and palm with better poses", 0.65)
    found = searcher.improve(hand_of(fitted.values, side), found.poses)
    good = found.best(options.good_views)
    fitted = fit(good, found.poses[good], fitted.values, 6)
    report("confidence", 0.9)
    fitted = fit(good, fitted.poses, fitted.values, 4, exact=True)
    values = with_usual_proportions(fitted.values)
    after = _refined(searcher, found.poses, values, side)
    report("done", 1.0)
    return Calibration(
        hand_of(values, side, source),
        _measured(values, fitted.covariance),
        None,
        1000 * float(np.median(before.distances[good])),
        1000 * float(np.median(after.distances[good])),
        tuple(searcher.observations[i] for i in good),
        after.poses[good],
        before.poses[good],
        options.sure_margin,
    )


def _initialise(searcher: PoseSearcher, side: Side) -> tuple[Array, Found]:
    """Return sizes (35,) from a few open hands, and the poses of such a hand in all views.

    A hand of wrong sizes often fits a view best in a wrong pose, with one finger in place of the next. So each likely
    pose gets sizes of its own, and sizes are judged by their energies in the other views.
    """
    options = searcher.options
    first = searcher.views[: options.first]
    likely: list[list[tuple[float, Array, float]]] = [[] for _ in first]
    for scale in options.tried_scales:
        for n, (poses, energies) in enumerate(searcher.candidates(HandShape(side=side, scale=scale), len(first))):
            likely[n] += [(float(e), pose, scale) for pose, e in zip(poses, energies, strict=True)]
    hands: list[tuple[float, Array]] = []
    for n, view in enumerate(first):
        for _, pose, scale in sorted(likely[n], key=lambda entry: entry[0])[: options.likely]:
            values = np.zeros(COUNT)
            values[SCALE] = np.log(scale)
            fit = fit_jointly([view], pose[None], values, side, 6, options=options.joint)
            hands.append((searcher.energy(hand_of(fit.values, side), n, fit.poses[0]), fit.values))
    tried = [values for _, values in sorted(hands, key=lambda entry: entry[0])[: options.crossed]]
    found = [searcher.find(hand_of(values, side), len(first)) for values in tried]
    best = min(range(len(tried)), key=lambda k: found[k].energies.mean())
    fit = fit_jointly(first, found[best].poses, tried[best], side, 6, options=options.joint)
    return fit.values, searcher.find(hand_of(fit.values, side), attempts=2)


def _refined(searcher: PoseSearcher, poses: Array, values: Array, side: Side) -> JointFit:
    """Return the fit of the poses alone, for a hand of fixed sizes."""
    return fit_jointly(searcher.views, poses, values, side, 8, slice(0, 0), options=searcher.options.joint)


def with_usual_proportions(values: Array) -> Array:
    """Return sizes (35,) of the same hand with usual proportions.

    The median factor of fingers and palm moves into the scale.
    """
    parts = np.append(values[LENGTHS].reshape(5, 3).mean(axis=1), values[PALM][:2])
    common = float(np.median(parts))
    out = values.copy()
    out[0] += common
    out[1:24] -= common  # lengths, widths and palm
    out[24:] /= np.exp(common)
    # The factors of the palm do not move the base of the thumb out of the palm: its offset has to.
    height = HandShape().bases[0, 2]
    out[-1] += height / np.exp(common) - height
    return out


def _measured(values: Array, covariance: Array) -> dict[str, Measured]:
    """Return each length and width, with its standard deviation and confidence."""
    prior = prior_covariance()
    table = {}
    for name, (metres, gradient) in measures(values).items():
        variance, before = float(gradient @ covariance @ gradient), float(gradient @ prior @ gradient)
        mm = 1000 * metres
        table[name] = Measured(mm, mm * np.sqrt(variance), 1 - variance / before)
    return table


def summary(calibration: Calibration) -> dict[str, Any]:
    """Return the numbers that `depthtrack calibrate` prints."""
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

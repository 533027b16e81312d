"""Calibration of a hand of one side while it is tracked: sizes of fingers and palm.

The average hand is tracked first. Sizes and poses are then optimised jointly in its views, and a hand of these sizes is
tracked in its place. Better sizes give better poses, and those give better sizes, until the sizes stay. Every second
hand is not tracked: its poses are fitted from those of the views. The alternation follows Tkach et al., "Online
generative model personalization for hand tracking", SIGGRAPH Asia 2017, over a recording.
"""

from collections.abc import Callable
from collections.abc import Sequence as Views
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from depthtrack.calibration.acceptance import check_resembles_hand
from depthtrack.calibration.joint_optimisation import fit_jointly, size_covariance
from depthtrack.calibration.options import CalibrationOptions
from depthtrack.calibration.pose_search import Progress
from depthtrack.calibration.residuals import CalibrationView
from depthtrack.calibration.solid_hands import nearest_solid
from depthtrack.errors import InputError
from depthtrack.files import compact_json
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.size_parameters import COUNT, LENGTHS, PALM, WIDTHS, hand_of, measures
from depthtrack.recording.sequence import Sequence
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.tracking.stretches import TrackedView, refine_views, track_stretches
from depthtrack.types import Array

_POSE_ITERATIONS = 8
"""Iterations of the poses alone, for the hands before and after calibration."""
_USUAL_LENGTHS = (110, 240)
"""Length of the hand of children at school and of adults, mm, with a margin for its error."""


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
    energies: (N,) of the last hand that was tracked, in all tracked frames; NaN without a pose.
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
    energies: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def side_sure(self) -> bool:
        """Whether the side was given, or the other one fits clearly worse."""
        return self.side_margin is None or self.side_margin >= self.sure_margin

    @property
    def is_of_usual_size(self) -> bool:
        """Whether a person may have such a hand; else the unit of the depth is probably wrong."""
        return _USUAL_LENGTHS[0] <= self.measured["hand_length"].mm <= _USUAL_LENGTHS[1]

    def to_json(self) -> str:
        """Return the text of `hand.json`, with the measured sizes and their uncertainty."""
        measured = {
            name: {"mm": round(m.mm, 2), "sigma_mm": round(m.sigma_mm, 2), "confidence": round(m.confidence, 2)}
            for name, m in self.measured.items()
        }
        return compact_json({**self.hand.to_fields(), "measured": measured})


def calibrate(
    sequence: Sequence,
    side: Side = "right",
    views: Views[TrackedView] = (),
    segmentation: SegmentationOptions | None = None,
    seed: int = 0,
    threads: int = 1,
    frames: int | None = None,
    progress: Progress | None = None,
    options: CalibrationOptions | None = None,
) -> Calibration:
    """Return the calibration of the hand of a recording.

    views: poses of the average hand of this side; without them, it is tracked first.
    frames: number of first frames to use; all if None.
    progress: called with a description of the current stage, and the completed share.

    Equal recordings and seeds give an equal hand, for any number of threads.

    Raises:
        InputError: if too few frames show a hand, or what they show does not resemble one.
    """
    report = progress or (lambda stage, share: None)
    options = options or CalibrationOptions()
    stretches = replace(options.stretches, tracker=replace(options.stretches.tracker, seed=seed))
    values, rounds, joint, energies = np.zeros(COUNT), options.rounds, options.joint, np.zeros(0)
    for number in range(rounds):
        hand = hand_of(values, side)
        if number % 2 == 1 or not views:
            show = _part(report, number / rounds, 0.6 / rounds)
            energies, views = track_stretches(sequence, hand, segmentation, threads, frames, stretches, show)
        elif number > 0:
            views = refine_views(views, hand, stretches.tracker, threads)
        _check_views(views, sequence, options)
        report("fingers and palm", (number + 0.6) / rounds)
        rows = best_rows(views, options.accepted.good_views)
        chosen = [views[row] for row in rows]
        observed, poses = [CalibrationView(each.observation) for each in chosen], np.stack([v.pose for v in chosen])
        fitted = fit_jointly(observed, poses, values, side, options.iterations, options=joint, threads=threads)
        found = nearest_solid(fitted.values, side)
        change, values = np.abs(found - values)[: WIDTHS.start].max(), found
        if number > 0 and change < options.converged:
            break
        poses_of = dict(zip(rows, fitted.poses, strict=True))
        views = [view._replace(pose=poses_of.get(row, view.pose)) for row, view in enumerate(views)]
    report("confidence", 0.95)
    last = options.exact_iterations
    fitted = fit_jointly(observed, fitted.poses, values, side, last, exact=True, options=joint, threads=threads)
    values = with_usual_proportions(fitted.values)
    before, after = (
        fit_jointly(observed, fitted.poses, sizes, side, _POSE_ITERATIONS, slice(0, 0), options=joint, threads=threads)
        for sizes in (np.zeros(COUNT), values)
    )
    report("done", 1.0)
    return Calibration(
        hand_of(values, side, f"calibrated on {sequence.name}"),
        measured_sizes(values, fitted.covariance, size_covariance(joint)),
        None,
        1000 * float(np.median(before.distances)),
        1000 * float(np.median(after.distances)),
        tuple(each.observation for each in chosen),
        after.poses,
        before.poses,
        options.sure_margin,
        energies,
    )


def _part(report: Progress, begun: float, share: float) -> Callable[[int, int], None]:
    """Return the progress of a part of the work that tracks frames."""
    return lambda done, total: report("poses of the hand", begun + share * done / total)


def best_views(views: Views[TrackedView], share: float) -> list[TrackedView]:
    """Return the share of the views with the lowest energies, at least two, in order."""
    return [views[row] for row in best_rows(views, share)]


def best_rows(views: Views[TrackedView], share: float) -> list[int]:
    """Return the rows of `best_views`."""
    order = np.argsort([each.energy for each in views], kind="stable")
    return sorted(order[: max(2, round(share * len(views)))].tolist())


def _check_views(views: Views[TrackedView], sequence: Sequence, options: CalibrationOptions) -> None:
    """Check that enough views show a hand.

    Raises:
        InputError: if they do not.
    """
    if len(views) < options.fewest:
        raise InputError(
            f"a hand was tracked in {len(views)} of {min(len(sequence), options.stretches.views)} frames of "
            f"{sequence.name}: calibrating needs at least {options.fewest} frames that show a bare hand, "
            "best with open fingers towards the camera"
        )
    check_resembles_hand([each.agreement for each in views], options.accepted.hand_like)


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


def measured_sizes(values: Array, covariance: Array, prior: Array) -> dict[str, Measured]:
    """Return each length and width, with its standard deviation and confidence.

    values: (35,) sizes.
    covariance, prior: (35, 35) of them, with and without the views.
    """
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

"""Calibration of a hand of one side on a recording: sizes of fingers and palm, and its skin."""

from collections.abc import Sequence as Views
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from depthtrack.calibration.first_scale import FirstHand, first_hand
from depthtrack.calibration.fitted_hand import FittedHand, fit_sizes, fit_skin, prepared, with_usual_proportions
from depthtrack.calibration.joint_optimisation import fit_jointly, size_covariance
from depthtrack.calibration.options import CalibrationOptions
from depthtrack.calibration.pose_search import Progress
from depthtrack.calibration.recorded_views import CalibrationSource
from depthtrack.files import compact_json
from depthtrack.hand.pose import ANGLES, FINGERS
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.size_parameters import COUNT, hand_of, measures
from depthtrack.recording.sequence import Sequence
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.tracking.stretches import TrackedView
from depthtrack.types import Array

_POSE_ITERATIONS = 4, 2
"""Iterations of the poses alone, for the hands before and after calibration; the latter's are nearly there."""
_USUAL_LENGTHS = (110, 240)
"""Length of the hand of children at school and of adults, mm, with a margin for its error."""
_STIFF = np.radians(20)
"""Range of a finger's flexion over the views, rad, below which it hardly bends."""


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
    side_agrees: whether hands of average proportions fit this side no worse than the other one.
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
    side_agrees: bool = True

    @property
    def side_sure(self) -> bool:
        """Whether the side was given, or the other one fits clearly worse."""
        return self.side_margin is None or (self.side_agrees and self.side_margin >= self.sure_margin)

    @property
    def is_of_usual_size(self) -> bool:
        """Whether a person may have such a hand; else the unit of the depth is probably wrong."""
        return _USUAL_LENGTHS[0] <= self.measured["hand_length"].mm <= _USUAL_LENGTHS[1]

    @property
    def stiff_fingers(self) -> tuple[str, ...]:
        """Fingers without the thumb that hardly bend in the views.

        Such views leave open where their joints lie.
        """
        if len(self.poses) == 0:
            return ()
        flexion = self.poses[:, ANGLES].reshape(-1, len(FINGERS), 4)[..., 1:]
        ranges = np.ptp(flexion, axis=0).max(axis=-1)
        return tuple(name for name, each in zip(FINGERS[1:], ranges[1:], strict=True) if each < _STIFF)

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
    first: FirstHand | None = None,
) -> Calibration:
    """Return the calibration of the hand of a recording.

    views: poses of the hand of average proportions; without them, it is tracked first.
    frames: number of first frames to use; all if None.
    progress: called with a description of the current stage, and the completed share.
    first: hand of average proportions to begin with; None to find it first.

    Equal recordings and seeds give an equal hand, for any number of threads.

    Raises:
        InputError: if too few frames show a hand, or what they show does not resemble one.
    """
    source = CalibrationSource(sequence, segmentation, seed, threads, frames, options or CalibrationOptions())
    report = progress or (lambda stage, share: None)
    report("size of the hand", 0.0)
    begun = first_hand(source, side) if first is None else first
    sizes = fit_sizes(source, side, begun, views, lambda stage, share: report(stage, 0.6 * share))
    skin = fit_skin(source, sizes, lambda stage, share: report(stage, 0.6 + 0.35 * share))
    report("confidence", 0.95)
    found = calibration_of(source, skin)
    report("done", 1.0)
    return found


def calibration_of(source: CalibrationSource, fitted: FittedHand) -> Calibration:
    """Return the calibration with a fitted hand, compared with the average one."""
    joint, threads, side = source.options.joint, source.threads, fitted.side
    observed, _ = prepared(fitted.views, threads)
    before, after = (
        fit_jointly(
            observed,
            fitted.poses,
            values,
            side,
            iterations,
            slice(0, 0),
            exact=len(values) > COUNT,
            options=joint,
            threads=threads,
        )
        for values, iterations in zip((np.zeros(COUNT), fitted.values), _POSE_ITERATIONS, strict=True)
    )
    return Calibration(
        hand_of(with_usual_proportions(fitted.values), side, f"calibrated on {source.sequence.name}"),
        measured_sizes(fitted.values[:COUNT], fitted.covariance, size_covariance(joint)),
        None,
        1000 * float(np.median(before.distances)),
        1000 * float(np.median(after.distances)),
        tuple(each.observation for each in fitted.views),
        after.poses,
        before.poses,
        source.options.sure_margin,
        fitted.energies,
    )


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

"""Tuning values of calibration, with units. Those without a source were tuned on synthetic recordings."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class ViewChoiceOptions:
    """Choice of the frames that sizes are measured on.

    views: frames used at most. inspected: frames of a recording that are segmented at most, spread over all of it.
    finger_half_breadth: m, radius of a disc that fits into a palm and into no finger. fewest: frames with a hand below
    which calibration is refused.
    """

    views: int = 16
    inspected: int = 240
    finger_half_breadth: float = 0.013
    fewest: int = 3


@dataclass(frozen=True)
class JointFitOptions:
    """Weights and steps of the joint optimisation of sizes and poses.

    kernel_scale: m, scale of the Geman-McClure kernel in the first and in the last iteration. noise: m, standard
    deviation of one patch of skin about the model at best. misfit: the same in median distances to the skin, since
    errors that no sizes can remove are alike in all views and do not average out. step_spread: m, rad and rad, standard
    deviation of a step in translation, rotation and angles; it keeps what the view does not determine. largest_change:
    of the logarithm of a size in one iteration; the skin is linear within about that.
    """

    kernel_scale: tuple[float, float] = (0.020, 0.006)
    noise: float = 0.0015
    misfit: float = 2.5
    step_spread: tuple[float, float, float] = (0.03, 0.2, 0.3)
    largest_change: float = 0.08


@dataclass(frozen=True)
class CalibrationOptions:
    """Search for side, scale and poses, and the acceptance of a result.

    first: views with the most open hands, on which side and scale are tried. tried_scales: scales of the average hand.
    likely: poses of each of those views that get sizes of their own. crossed: sizes that are tried on the other views.
    resolution: pixels, longest side of the image in which poses are searched. good_views: share of the views that are
    fitted, those with the lowest energies. hand_like: agreement of silhouettes (1 - skin term of Oikonomidis et al.
    2011, Eq. 2) below which no hand was found. sure_margin: extra energy of the other side, a share, from which on the
    side is sure.
    """

    first: int = 4
    tried_scales: tuple[float, ...] = (0.76, 0.9, 1.06, 1.24)
    likely: int = 6
    crossed: int = 6
    resolution: int = 96
    good_views: float = 0.7
    hand_like: float = 0.55
    sure_margin: float = 0.02
    joint: JointFitOptions = field(default_factory=JointFitOptions)

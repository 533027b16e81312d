"""Options of the labelling: prediction, assignment, pose fit, tracklets."""

from dataclasses import dataclass
from typing import Literal

from depthtrack.errors import InputError
from depthtrack.options import check_ranges, option

Prediction = Literal["trajectory", "model"]
"""Where a marker is expected.

`trajectory`: a visible marker goes on with its own velocity; a missing one is where the model and its last residual put
it. `model`: all markers are where the model puts them (Maycock et al. 2015).
"""

_MAYCOCK = "Maycock et al. 2015"


@dataclass(frozen=True)
class PredictionOptions:
    """Expected position and spread of each marker."""

    kind: Prediction = option("trajectory", "Prediction from each marker's own trajectory, or from the model alone")
    velocity_gain: float = option(
        0.7, "Share of the innovation that corrects the velocity, over the frame time", most=1
    )
    noise: float = option(0.0007, "Standard deviation of a measured coordinate", unit="m", least=1e-6)
    acceleration: float = option(25.0, "Standard deviation of a marker's acceleration", unit="m/s^2", least=1e-4)
    joint_speed: float = option(4.0, "Drift of a joint that moves no visible marker", unit="rad/s")
    joint_range: float = option(0.5, "Largest standard deviation of such a joint", unit="rad", least=1e-4)
    determined: float = option(
        0.08, "Standard deviation of a joint that moves a visible marker", unit="rad", least=1e-4
    )
    palm_speed: float = option(0.5, "Drift of a model with fewer than three visible markers", unit="m/s")
    largest: float = option(0.06, "Largest standard deviation of a predicted position", unit="m", least=1e-4)
    residual_gain: float = option(
        0.03, "Share of a new residual in the residual that is kept while a marker is missing", most=1
    )
    familiar: int = option(
        20, "Frames after which a marker's own residual counts as much as its place on the model", least=1
    )


@dataclass(frozen=True)
class AssignmentOptions:
    """Assignment of the points of a frame to markers."""

    padded: bool = option(
        False, "Minimise the sum of distances with padding, then reject by distance", source=f"{_MAYCOCK}, Eq. (3)"
    )
    distance_term: float = option(
        0.02, "Term that is added to the mean error to give the largest distance, if padded", unit="m", source=_MAYCOCK
    )
    clutter: float = option(20.0, "Expected density of points without a marker", unit="1/m^3", least=1e-6, most=1000000)
    seen_again: float = option(0.99, "Probability that a visible marker is visible in the next frame", most=1)
    reappears: float = option(0.1, "Probability that a missing marker is visible in the next frame", most=1)
    reject: float = option(6.0, "Residual after the fit at which a point loses its label", unit="standard deviations")
    reject_new: float = option(4.0, "The same for a marker that was missing", unit="standard deviations")
    patience: int = option(5, "Frames in a row with that residual before a visible marker loses its label", least=1)
    swap: float = option(
        60.0, "Accumulated log-likelihood ratio at which two markers exchange their points", most=10000
    )


@dataclass(frozen=True)
class FitOptions:
    """Pose of each model from its labelled points: damped Gauss-Newton."""

    iterations: int = option(
        4, "Gauss-Newton steps per frame, at most", source=f"{_MAYCOCK}: 5 to 10", least=1, most=1000
    )
    damping: float = option(2e-7, "Damping of each finger angle", unit="m^2/rad^2", source=f"{_MAYCOCK}, Eq. (4)")
    avoid_limits: bool = option(False, "Increase the damping towards joint limits", source="Chan and Dubey 1995")
    freeze: bool = option(True, "Hold the joints that move no visible marker", source=f"{_MAYCOCK}, Sec. III-C")
    least_spread: float = option(
        0.0015, "Least standard deviation of a marker about its place on the body", unit="m", least=1e-6
    )
    robust: float = option(
        3.0, "Residual at which a point has a quarter of its weight; 0: equal weights", unit="standard deviations"
    )


@dataclass(frozen=True)
class LostOptions:
    """When a model counts as lost."""

    least_share: float = option(0.35, "Share of labelled markers below which a model is getting lost", most=1)
    largest_error: float = option(0.012, "Mean residual above which a model is getting lost", unit="m", least=1e-6)
    seconds: float = option(0.25, "Time in which it must recover", unit="s")
    retry: float = option(0.1, "Time between two searches for a model that is lost", unit="s", least=1e-3)


@dataclass(frozen=True)
class OfflineOptions:
    """Labelling of a whole capture at once."""

    use: bool = option(True, "Track in both directions, and decide tracklets by all of their frames")
    rounds: int = option(6, "Rounds of pose fits and assignments of tracklets, at most", least=1, most=100)
    split: float = option(60.0, "Log-likelihood ratio from which on a tracklet of two markers is cut", most=10000)
    adopt: float = option(0.1, "Shortest tracklet without a label that is tried as a marker by a fit", unit="s")
    suspect_ratio: float = option(
        3.0, "Multiple of a marker's usual residual from which on its exchange with another one is tried"
    )
    suspect_residual: float = option(0.002, "Least residual at which an exchange is tried", unit="m")
    exchange: float = option(
        0.5, "Ratio of the squared residuals below which two markers are exchanged; 0: never exchange", most=1
    )
    link_gate: float = option(3.0, "Largest distance of a link between frames", unit="standard deviations", least=1e-4)
    link_clear: float = option(2.0, "By how much farther the next best link must be", unit="standard deviations")
    link_speed: float = option(
        0.3, "Standard deviation of the speed of a point without a known motion", unit="m/s", least=1e-4
    )


@dataclass(frozen=True)
class LabellingOptions:
    """Labelling of a capture."""

    prediction: PredictionOptions = option(PredictionOptions(), "Prediction of each marker")
    assignment: AssignmentOptions = option(AssignmentOptions(), "Assignment of points to markers")
    fit: FitOptions = option(FitOptions(), "Fit of each model's pose")
    lost: LostOptions = option(LostOptions(), "Loss of a model")
    offline: OfflineOptions = option(OfflineOptions(), "Labelling of a whole capture")

    def __post_init__(self) -> None:
        check_ranges(self)
        for name in ("seen_again", "reappears"):
            probability = getattr(self.assignment, name)
            if probability in (0, 1):
                raise InputError(f"{name} must be between 0 and 1 but neither of them, found {probability}")


PAPER_LABELLING = LabellingOptions(
    PredictionOptions(kind="model"),
    AssignmentOptions(padded=True),
    FitOptions(iterations=10, damping=1e-6, avoid_limits=True, robust=0.0),
    offline=OfflineOptions(use=False),
)
"""Maycock et al. 2015, Sec. III-B."""

"""Options of gap filling."""

from dataclasses import dataclass
from typing import Literal

from depthtrack.options import check_ranges, option

FillMethod = Literal["smooth", "paper", "spline", "pattern", "pca"]
"""How gaps are filled.

`smooth`: the likeliest postures given the visible markers and the motion of the capture, with a regression on them.
`paper`: angles of frozen joints are interpolated (Maycock et al. 2015, Sec. III-C). The others are baselines.
`spline`: a cubic spline per marker. `pattern`: the rigid motion of the neighbours. `pca`: principal components of all
markers (Gloersen and Federolf 2016).
"""

_MAYCOCK = "Maycock et al. 2015, Sec. III-C"
_GLOERSEN = "Gloersen and Federolf 2016"


@dataclass(frozen=True)
class PaperFillOptions:
    """Frozen joints and interpolated angles (Maycock et al. 2015, Sec. III-C)."""

    plausible_distance: float = option(
        0.005,
        "A marker reappears where its distance from the model exceeds the mean by at most this",
        unit="m",
        source=_MAYCOCK,
    )


@dataclass(frozen=True)
class RegressionOptions:
    """Linear regression of a missing marker on the others; see `filling.marker_regression`."""

    visible_share: float = option(0.7, "A marker takes part if it is visible in at least this share of the gap", most=1)
    fewest_seconds: float = option(2.0, "Least time of the capture to learn from", unit="s")
    local_weight: float = option(
        10.0, "Weight of the frames beside the gap, relative to distant ones, less 1", most=10000
    )
    local_time: float = option(0.5, "Time over which that weight falls", unit="s", least=1e-4)
    block_time: float = option(1.5, "Time of the capture that is held out at once", unit="s", least=0.01)
    end_time: float = option(0.2, "Time beside the gap whose error corrects the regression", unit="s")


@dataclass(frozen=True)
class SmoothFillOptions:
    """The likeliest postures of a gap; see `filling.smoothing`."""

    border: float = option(0.25, "Measured time on both sides of a gap that takes part", unit="s")
    marker_noise: float = option(0.001, "Standard deviation of a visible marker from the model", unit="m", least=1e-6)
    time_scale: float = option(1.0, "Time constants of the motion, relative to those of the capture", least=0.01)
    angle_noise: float = option(
        0.03, "Standard deviation of an angle that no other one predicts", unit="rad", least=1e-4
    )
    database_time: float = option(2.0, "Duration of the capture that weighs as much as recorded postures", unit="s")
    palm_acceleration: float = option(
        20.0, "Standard deviation of the palm's acceleration over 0.1 s", unit="m/s^2", least=1e-4
    )
    palm_turn: float = option(200.0, "The same for its rotation", unit="rad/s^2", least=1e-4)
    correction_time: float = option(
        0.03, "Time over which a marker's distance from the model is averaged", unit="s", least=1e-4
    )
    piece: float = option(
        20.0, "Time that is smoothed at once; longer stretches are cut into pieces", unit="s", least=0.1
    )
    wander_time: float = option(0.2, "Time in which markers move on their bodies", unit="s", least=1e-4)
    iterations: int = option(8, "Gauss-Newton steps, at most", least=1, most=1000)
    regress: bool = option(True, "Average the smoothed markers with their regression on the others")
    regression: RegressionOptions = option(RegressionOptions(), "Regression")


@dataclass(frozen=True)
class PatternFillOptions:
    """Rigid motion of the neighbours of a marker."""

    neighbours: int = option(3, "Markers whose rigid motion a missing one follows", least=3, most=1000)


@dataclass(frozen=True)
class PcaFillOptions:
    """Principal components of all markers (Gloersen and Federolf 2016)."""

    strategy: Literal["R1", "R2"] = option(
        "R2", "Reconstruct all markers with gaps at once, or each alone", source=_GLOERSEN
    )
    weight_scale: float = option(
        0.2, "Distance over which the weight of a marker falls", unit="m", source=_GLOERSEN, least=1e-4
    )
    missing_weight: float = option(0.02, "Weight of the missing markers", source=_GLOERSEN)
    variance_share: float = option(0.99, "Share of the summed singular values that is kept", source=_GLOERSEN, most=1)


@dataclass(frozen=True)
class FillOptions:
    """How the gaps of a labelled capture are filled."""

    method: FillMethod = option("smooth", "Method", source=f"paper: {_MAYCOCK}")
    longest: float = option(2.0, "Longer gaps stay gaps", unit="s", least=1e-3)
    ends: bool = option(False, "Fill gaps at the start and the end of the capture too")
    paper: PaperFillOptions = option(PaperFillOptions(), _MAYCOCK, advanced=True)
    smooth: SmoothFillOptions = option(SmoothFillOptions(), "Smoothing", advanced=True)
    pattern: PatternFillOptions = option(PatternFillOptions(), "Rigid pattern", advanced=True)
    pca: PcaFillOptions = option(PcaFillOptions(), _GLOERSEN, advanced=True)

    def __post_init__(self) -> None:
        check_ranges(self)

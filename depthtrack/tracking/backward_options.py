"""Options of the backward pass, and whether a run has one."""

from dataclasses import dataclass

from depthtrack.errors import InputError
from depthtrack.options import check_ranges, option
from depthtrack.tracking.configuration import HybridConfig, IkConfig, PsoConfig, TrackerConfig


@dataclass(frozen=True)
class BackwardOptions:
    """Stretches that are tracked backwards, and the choice between both directions."""

    doubtful: float = option(0.3, "A stretch with a pose of lower confidence is tracked backwards", most=1)
    confident: float = option(0.5, "Confidence of the poses before and after a stretch", most=1)
    confidence_weight: float = option(
        0.5,
        "Energy that a confidence of 1 makes up for",
        unit="clamp",
        source="tools/tune_backward.py on the tuning seeds 0 to 3 of the cross-model benchmark",
        most=100,
    )
    gain: float = option(
        0.05, "Energy by which a backward pose must be better", unit="clamp", source="as `confidence_weight`", most=100
    )
    motion_weight: float = option(
        20.0, "Energy of each metre that the keypoints move", unit="clamp/m", source="as `confidence_weight`", most=1000
    )
    pause: float = option(0.3, "Time between two frames beyond which a hand is not followed backwards", unit="s")

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.doubtful > self.confident:
            raise InputError(f"doubtful must be at most confident, {self.confident:g}, found {self.doubtful:g}")


def chosen_backward(choice: bool | BackwardOptions | None, tracker: TrackerConfig) -> BackwardOptions | None:
    """Return the options of the backward pass; None for none.

    choice: whether there is one, or its options. By default, the trackers of papers go forward alone, and so does one
        with a deadline. A lift has no direction.

    Raises:
        InputError: the choice is of another type.
    """
    if isinstance(choice, BackwardOptions):
        return choice
    if choice is not None and not isinstance(choice, bool):
        raise InputError(f"backward must be true, false, absent or BackwardOptions, found {choice!r:.40}")
    if choice is None:
        choice = isinstance(tracker, HybridConfig | IkConfig | PsoConfig)
        choice = choice and getattr(tracker, "deadline", None) is None
    return BackwardOptions() if choice else None

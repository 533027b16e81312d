"""What experiments on following a motion share."""

from depthtrack.options import parameters, with_options
from depthtrack.tracking.configuration import TrackerConfig

_OFF = {
    "thresholds.confidence": 0.0,
    "thresholds.energy": float("inf"),
    "recovery.every": 0,
    "recovery.accept_finger": 0.0,
    "recovery.doubt_confidence": 0.0,
    "recovery.doubt_energy": float("inf"),
}


def without_recovery(config: TrackerConfig) -> TrackerConfig:
    """Return a tracker that never loses the hand and never searches.

    A search would correct what an experiment measures, and cost more than many frames.
    """
    known = {parameter.path for parameter in parameters(config)}
    return with_options(config, {name: value for name, value in _OFF.items() if name in known})

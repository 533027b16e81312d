"""Switch off the recovery of trackers for the experiments of the papers."""

from depthtrack.options import parameters, with_options
from depthtrack.tracking.configuration import TrackerConfig

_OFF = {
    "thresholds.confidence": 0.0,
    "thresholds.agreement": 0.0,
    "thresholds.energy": float("inf"),
    "thresholds.longest_gap": float("inf"),
    "recovery.every": 0,
    "recovery.accept_finger": 0.0,
    "recovery.doubt_agreement": 0.0,
    "recovery.doubt_energy": float("inf"),
}


def without_recovery(config: TrackerConfig) -> TrackerConfig:
    """Return the configuration without losses and without searches.

    A search would correct the error that an experiment measures, and takes more time than many frames.
    """
    known = {parameter.path for parameter in parameters(config)}
    return with_options(config, {name: value for name, value in _OFF.items() if name in known})

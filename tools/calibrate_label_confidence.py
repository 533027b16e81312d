"""Fit the weights of the confidence of labels to synthetic captures of seeds below 100.

They stand in `depthtrack/markers/labelling/confidence.py`.

python tools/calibrate_label_confidence.py [SEED ...]
"""

import sys

import numpy as np
from scipy.optimize import minimize

from depthtrack.markers.labelling.offline import in_both_directions, resolve
from depthtrack.markers.labelling.options import LabellingOptions
from depthtrack.markers.labelling.packed import PackedPoints
from depthtrack.markers.labelling.scene import Scene
from depthtrack.markers.labelling.state import Settings
from depthtrack.markers.labelling.tracklets import LinkSettings
from depthtrack.synthesis.marker_capture import MarkerSynthesis, SyntheticMarkers, synthesise_markers
from depthtrack.synthesis.marker_measurement import MeasurementErrors
from depthtrack.types import Array, Mask

MOTIONS = ("everyday", "grasp", "random")
HARD = MeasurementErrors(dropouts=0.1, bursts=(0.05, 1.0), ghosts=5)
PENALTY = 1e-2
"""Weight of the squared weights, so that features without an effect get none."""


def captures(seeds: list[int]) -> list[SyntheticMarkers]:
    """Return captures of one hand with few errors, and of two hands that touch with many."""
    usual = [MarkerSynthesis(motion, frames=2000, seed=seed) for motion in MOTIONS for seed in seeds]
    hard = [
        MarkerSynthesis(motion, frames=2000, seed=seed, two_hands=True, touching=True, errors=HARD)
        for motion in MOTIONS
        for seed in seeds
    ]
    return [synthesise_markers(options) for options in (*usual, *hard)]


def samples(made: SyntheticMarkers) -> list[tuple[Array, Mask]]:
    """Return features (N, F) and whether the label is right (N,), online and offline."""
    options, truth = LabellingOptions(), np.concatenate(made.truth.columns, axis=1)
    points, models = PackedPoints.of(made.capture), made.truth.models
    scene, settings = Scene.of(models), Settings.of(options, made.capture.rate)
    starts = [poses[0] for poses in made.truth.poses]
    forward, backward = in_both_directions(points, models, scene, settings, starts, None, 0)
    links = LinkSettings.of(options, made.capture.rate)
    found = resolve(points, scene, settings, options.offline, links, forward, backward)
    out = []
    for labels, features in ((forward.labels, forward.features), (found.labels, found.features)):
        given = labels >= 0
        out.append((features[given], (points.columns(labels) == truth)[given]))
    return out


def fit(features: Array, right: Mask) -> Array:
    """Return the weights (F,) of a logistic regression."""
    sign = np.where(right, 1.0, -1.0)

    def loss(w: Array) -> tuple[float, Array]:
        x = sign * (features @ w)
        wrong = 1 / (1 + np.exp(np.clip(x, -500, 500)))
        return float(np.logaddexp(0, -x).sum() + PENALTY * w @ w), -(sign * wrong) @ features + 2 * PENALTY * w

    return np.asarray(minimize(loss, np.zeros(features.shape[1]), jac=True, method="L-BFGS-B").x)


def reliability(features: Array, right: Mask, weights: Array) -> None:
    """Print the share of right labels for ranges of the confidence."""
    sure = 1 / (1 + np.exp(-(features @ weights)))
    for low, high in ((0, 0.5), (0.5, 0.9), (0.9, 0.99), (0.99, 0.999), (0.999, 1.01)):
        inside = (sure >= low) & (sure < high)
        if inside.any():
            print(
                f"  {low:5.3f} to {min(high, 1):5.3f}: {sure[inside].mean():.5f} {right[inside].mean():.5f}",
                inside.sum(),
            )


def main(seeds: list[int]) -> None:
    """Fit both regressions to half of the seeds, and print their reliability on all others."""
    tried = [[samples(made) for made in captures(part)] for part in (seeds[::2], seeds[1::2])]
    for n, name in enumerate(("ONLINE", "OFFLINE")):
        (X, y), (X2, y2) = (
            (np.concatenate([each[n][0] for each in part]), np.concatenate([each[n][1] for each in part]))
            for part in tried
        )
        weights = fit(X, y)
        print(name, np.round(weights, 3).tolist())
        reliability(X2, y2, weights)


if __name__ == "__main__":
    main([int(seed) for seed in sys.argv[1:]] or list(range(1, 9)))

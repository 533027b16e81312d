"""Fit the weights of the confidence of labels to synthetic captures of seeds below 100.

They stand in `depthtrack/markers/labelling/confidence.py`. Captures are labelled as `markers label` does: offline with
the hands that were measured on them, online with those of the start, which is a right one here.

python tools/calibrate_label_confidence.py [--tuning SEED ...] [--report SEED ...]
"""

import argparse
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from scipy.optimize import minimize

from depthtrack.calibration.markers import calibrate_markers
from depthtrack.hand.size_parameters import COUNT
from depthtrack.markers.automatic import label_from, sized_models
from depthtrack.markers.initialisation.options import SearchOptions
from depthtrack.markers.initialisation.search import ModelSearch
from depthtrack.markers.initialisation.started import StartedModel, StartedModels
from depthtrack.markers.labelling.offline import in_both_directions, resolve, track_online
from depthtrack.markers.labelling.options import LabellingOptions
from depthtrack.markers.labelling.packed import PackedPoints
from depthtrack.markers.labelling.scene import Scene
from depthtrack.markers.labelling.state import Settings
from depthtrack.markers.labelling.tracklets import LinkSettings
from depthtrack.synthesis.marker_capture import MarkerSynthesis, SyntheticMarkers, synthesise_markers
from depthtrack.synthesis.marker_measurement import MeasurementErrors
from depthtrack.types import Array, Index, Mask

MOTIONS = ("everyday", "grasp", "random")
LAYOUTS = ("26", "13")
HARD = MeasurementErrors(dropouts=0.1, bursts=(0.05, 1.0), ghosts=5)
FRAMES = 1000
PENALTY = 1e-2
"""Weight of the squared weights, so that features without an effect get none."""
EDGES = (0.0, 0.5, 0.7, 0.9, 0.97, 0.99, 0.999, 1.01)
"""Ranges of the confidence that the reliability is printed for."""

Samples = tuple[Array, Mask]
"""Features (N, F), and whether the label is right (N,)."""


def captures(seed: int) -> Iterator[SyntheticMarkers]:
    """Yield captures of one hand with few errors, and of two hands that touch with many."""
    for motion in MOTIONS:
        for layout in LAYOUTS:
            usual = MarkerSynthesis(motion, layout, frames=FRAMES, seed=seed)
            hard = MarkerSynthesis(motion, layout, frames=FRAMES, seed=seed, two_hands=True, touching=True, errors=HARD)
            yield from (synthesise_markers(options) for options in (usual, hard))


def true_start(made: SyntheticMarkers) -> StartedModels:
    """Return the models of the user, sized by the true labels of the first frame."""
    points, columns = made.capture.points(0)
    number = np.full(len(made.capture.labels) + 1, -1)
    number[columns] = np.arange(len(points))
    started = []
    for model, truth, poses in zip(made.models, made.truth.columns, made.truth.poses, strict=True):
        fitter = ModelSearch.of(model, SearchOptions()).fitter
        pose, sizes, assigned = poses[0].copy(), np.zeros(COUNT), number[truth[0]]
        energy, _ = fitter.fit(pose, sizes, points, assigned)
        started.append(StartedModel(fitter.fitted_model(sizes), pose, assigned, energy, 0.0, 1.0, 1.0))
    return StartedModels(tuple(started))


def samples(made: SyntheticMarkers) -> tuple[Samples, Samples]:
    """Return the samples of a capture, online and offline."""
    options, truth = LabellingOptions(), np.concatenate(made.truth.columns, axis=1)
    points, started = PackedPoints.of(made.capture), true_start(made)
    settings, starts = Settings.of(options, made.capture.rate), [one.pose for one in started.found]
    sized = sized_models(made.models, started)
    online = track_online(points, sized, Scene.of(sized), settings, starts, None, 0)
    first = label_from(made.capture, sized, started, options)
    models = tuple(m if m.is_rigid else calibrate_markers(first, k).model for k, m in enumerate(sized))
    scene, links = Scene.of(models), LinkSettings.of(options, made.capture.rate)
    passes = in_both_directions(points, models, scene, settings, starts, None, 0)
    found = resolve(points, scene, settings, options.offline, links, *passes)

    def right(labels: Index, features: Array) -> Samples:
        given = labels >= 0
        return features[given], (points.columns(labels) == truth)[given]

    return right(online.labels, online.features), right(found.labels, found.features)


def fit(features: Array, right: Mask) -> Array:
    """Return the weights (F,) of a logistic regression."""
    sign = np.where(right, 1.0, -1.0)

    def loss(w: Array) -> tuple[float, Array]:
        x = sign * (features @ w)
        wrong = 1 / (1 + np.exp(np.clip(x, -500, 500)))
        return float(np.logaddexp(0, -x).sum() + PENALTY * w @ w), -(sign * wrong) @ features + 2 * PENALTY * w

    return np.asarray(minimize(loss, np.zeros(features.shape[1]), jac=True, method="L-BFGS-B").x)


def reliability(features: Array, right: Mask, weights: Array) -> None:
    """Print the mean confidence and the share of right labels for ranges of the confidence."""
    sure = 1 / (1 + np.exp(-(features @ weights)))
    for low, high in pairwise(EDGES):
        inside = (sure >= low) & (sure < high)
        if inside.any():
            figures = f"{sure[inside].mean():.4f} {right[inside].mean():.4f} {inside.sum():9}"
            print(f"  {low:5.3f} to {min(high, 1):5.3f}: {figures}")


def main(tuning: Sequence[int], report: Sequence[int]) -> None:
    """Fit both regressions to the tuning seeds, and print their reliability on the others."""
    fitted, tried = ([samples(made) for seed in seeds for made in captures(seed)] for seeds in (tuning, report))
    for n, name in enumerate(("ONLINE", "OFFLINE")):
        (X, y), (X2, y2) = (
            (np.concatenate([each[n][0] for each in part]), np.concatenate([each[n][1] for each in part]))
            for part in (fitted, tried)
        )
        weights = fit(X, y)
        print(name, np.round(weights, 3).tolist())
        print("  confidence: mean, share of right labels, samples")
        reliability(X2, y2, weights)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--tuning", type=int, nargs="+", default=list(range(1, 5)), help="seeds to fit to")
    parser.add_argument("--report", type=int, nargs="+", default=[1000, 1001], help="seeds to print the reliability of")
    given = parser.parse_args()
    main(given.tuning, given.report)

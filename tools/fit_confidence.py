"""Fit the confidence of estimates to the tuning seeds of the cross-model benchmark.

Usage: fit_confidence.py FOLDER [--rig RIG.glb ...] [--first-seed N] [--seeds N] [--frames N] [--check SPLIT]

The folder holds the evidence of each recording, from which an interrupted run continues. The fit is logistic
regression with equal weight for each recording. The sign of each coefficient is fixed: a larger residual or spread
never raises the confidence. The result is written to `depthtrack/tracking/confidence.json`.

Printed are the area under the ROC curve (AUROC) of recordings left out of the fit, and the reliability in ten bins. The
shares of keypoints within their spread follow, and the threshold of a trusted pose. The constants of
`depthtrack/tracking/spread.py` were chosen by these shares.

With `--check`, nothing is fitted: these figures are those of the present model on the seeds of a split.
"""

import argparse
import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from depthtrack.benchmarks.crossmodel.evidence import measure_evidence
from depthtrack.benchmarks.crossmodel.recordings import recording_cells
from depthtrack.benchmarks.papers.experiment import ExperimentOptions
from depthtrack.evaluation.metrics.reliability import SMALL, auroc
from depthtrack.evaluation.sweep.rows import Journal
from depthtrack.evaluation.sweep.run import run_sweep
from depthtrack.evaluation.sweep.workers import chosen_workers
from depthtrack.tracking.confidence import Evidence, fitted_model
from depthtrack.types import Array, Index, Mask

RIDGE = 1e-2
"""Weight of the squared coefficients of standardised evidence."""
FOLDS = 6
OUT = Path(__file__).parents[1] / "depthtrack" / "tracking" / "confidence.json"


def fit(evidence: Array, good: Mask, weights: Array) -> tuple[Array, float]:
    """Return the weights (F,) and the bias of the logistic function.

    evidence: (N, F).
    good: (N,) largest joint error below `SMALL`.
    weights: (N,) of the frames.
    """
    mean, spread = evidence.mean(axis=0), evidence.std(axis=0) + 1e-9
    features, sign = (evidence - mean) / spread, np.where(good, 1.0, -1.0)

    def loss(parameters: Array) -> tuple[float, Array]:
        margin = sign * (features @ parameters[:-1] + parameters[-1])
        slope = -weights * sign / (1 + np.exp(np.clip(margin, -50, 50)))
        value = (weights * np.logaddexp(0, -margin)).sum() + RIDGE * weights.sum() * (parameters[:-1] ** 2).sum()
        gradient = np.append(features.T @ slope + 2 * RIDGE * weights.sum() * parameters[:-1], slope.sum())
        return float(value), gradient

    bounds = [(None, 0.0)] * evidence.shape[1]
    start = np.zeros(evidence.shape[1] + 1)
    found = minimize(loss, start, jac=True, method="L-BFGS-B", bounds=[*bounds, (None, None)]).x
    scaled = found[:-1] / spread
    return scaled, float(found[-1] - scaled @ mean)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--rig", nargs="*", default=[])
    arguments.add_argument("--first-seed", type=int, default=0)
    arguments.add_argument("--seeds", type=int, default=4)
    arguments.add_argument("--frames", type=int, default=90)
    arguments.add_argument("--check", choices=("tuning", "report"))
    chosen = arguments.parse_args()
    options = ExperimentOptions(
        repetitions=chosen.seeds,
        first_seed=chosen.first_seed,
        frames=chosen.frames,
        rigs=tuple(chosen.rig),
        split=chosen.check or "tuning",
    )
    cells = recording_cells(options)
    with Journal(chosen.folder / "evidence.jsonl", list(cells[0])) as journal:
        rows = run_sweep(measure_evidence, cells, journal, chosen_workers(None))
    frames = [(number, *frame) for number, row in enumerate(rows) for frame in row["tracked"]]
    recording = np.array([frame[0] for frame in frames])
    kinds, evidence = np.array([frame[1] for frame in frames]), np.array([frame[3] for frame in frames])
    good = np.array([frame[4] for frame in frames]) < SMALL
    weights = 1 / np.bincount(recording)[recording]
    print(f"{len(rows)} recordings, {len(frames)} frames, {100 * good.mean():.0f} % of them good")
    if chosen.check:
        model = fitted_model()
        margins = evidence @ np.array(model.weights) + model.bias
    else:
        margins = left_out_margins(recording, evidence, good, weights)
    report(kinds, margins, good, np.array([frame[5:] for frame in frames]))
    if not chosen.check:
        write(*fit(evidence, good, weights), len(rows))


def left_out_margins(recording: Index, evidence: Array, good: Mask, weights: Array) -> Array:
    """Return the logit (N,) of each frame's confidence, by a fit to other recordings.

    recording: (N,) number of the recording.
    """
    margins = np.empty(len(evidence))
    for fold in range(FOLDS):
        test = recording % FOLDS == fold
        coefficients, bias = fit(evidence[~test], good[~test], weights[~test])
        margins[test] = evidence[test] @ coefficients + bias
    return margins


def report(kinds: NDArray[np.str_], margins: Array, good: Mask, counts: Array) -> None:
    """Print AUROC, spread and reliability.

    kinds: (N,) of the hands.
    margins: (N,) logits of the confidence.
    counts: (N, 4) keypoints: visible, those within their spread, hidden, and those within theirs.
    """
    for kind in ("calibrated", "mirrored", "average"):
        part = kinds == kind
        print(f"AUROC, {kind} hand: {_auroc(margins[part], good[part])} ({100 * good[part].mean():.0f} % good)")
    measured = kinds != "average"
    print(f"AUROC, calibrated and mirrored hands: {_auroc(margins[measured], good[measured])}")
    print(f"AUROC, all: {_auroc(margins, good)}")
    probability = 1 / (1 + np.exp(-margins))
    for kind in ("calibrated", "average"):
        shown, shown_within, hidden, hidden_within = counts[kinds == kind].sum(axis=0)
        print(
            f"within the spread, {kind} hand: {shown_within / shown:.2f} visible, {hidden_within / hidden:.2f} hidden"
        )
    print(f"half of the lowest confidence of a good pose: {probability[good].min() / 2:.3f}")
    for low in np.arange(0, 1, 0.1):
        part = (probability >= low) & (probability < low + 0.1)
        if part.any():
            print(f"{low:.1f} to {low + 0.1:.1f}: {100 * good[part].mean():5.1f} % good of {part.sum()} frames")


def _auroc(margins: Array, good: Mask) -> str:
    """Return the area under the ROC curve as text."""
    area = auroc(margins, good)
    return "-" if area is None else f"{area:.3f}"


def write(coefficients: Array, bias: float, recordings: int) -> None:
    """Write the model.

    recordings: number of those that it was fitted to.
    """
    fields = {
        "about": "logistic function of the evidence; see depthtrack/tracking/confidence.py and tools/fit_confidence.py",
        "recordings": recordings,
        "weights": {name: float(f"{w:.6g}") for name, w in zip(Evidence._fields, coefficients, strict=True)},
        "bias": float(f"{bias:.6g}"),
    }
    OUT.write_text(json.dumps(fields, indent=2) + "\n")
    print(f"written to {OUT}")


if __name__ == "__main__":
    main()

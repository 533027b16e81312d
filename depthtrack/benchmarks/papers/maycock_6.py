"""Fig. 6 of Maycock et al. 2015: angles from automatic labels, and from true ones.

The trials of the paper are real ones, of 18 subjects. Here they are synthetic: other hands in other grasping motions.
The true labels are those of the synthesis, without errors of a person.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from time import process_time
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes

from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.evaluation.metrics.markers import AngleErrors
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.markers.automatic import find_start, label_from, sized_models
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.initialisation.started import StartedModels
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.labelled_fit import fit_poses
from depthtrack.markers.labelling.options import PAPER_LABELLING, LabellingOptions, OfflineOptions
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.synthesis.marker_capture import MarkerSynthesis, SyntheticMarkers, synthesise_markers
from depthtrack.synthesis.motion import load_motion
from depthtrack.types import Array

MOTIONS = ("grasp", "other-grasps")
TRIALS, QUICK_TRIALS = 200, 6
RATE, FRAMES, QUICK_FRAMES = 200.0, 1000, 200
FIRST_SEED = {"tuning": 0, "report": 1000}
SCENES = {"hand": "one hand of 26 markers", "scene": "two hands and three rigid bodies"}
PAPER_DEG, PAPER_SD_DEG = 0.085, 0.12
PAPER_HERTZ = {"hand": 75, "scene": 35}
_LEAST_DEG = 1e-4
"""Left end of the histogram, degrees."""


def cells(options: ExperimentOptions) -> list[Cell]:
    """Return a cell for each trial, and one for the speed of the larger scene."""
    first = FIRST_SEED[options.split]
    frames = options.frames or (QUICK_FRAMES if options.quick else FRAMES)
    shared: Cell = {"frames": frames, "variant": options.variant}
    trials = [
        {"scene": "hand", "motion": MOTIONS[number % 2], "seed": first + number} | shared
        for number in options.seeds(TRIALS, QUICK_TRIALS)
    ]
    return [*trials, {"scene": "scene", "motion": "grasp", "seed": first} | shared]


def label_trial(
    *, scene: Literal["hand", "scene"], motion: str, seed: int, frames: int, variant: Literal["default", "paper"]
) -> Row:
    """Label a synthetic capture, and compare its angles with those from true labels.

    `error_deg` is the difference of the paper: the mean absolute difference of angles over frames and angles. Both
    sides have the same model and pose fit. `seen_deg` leaves out the fingers with a dropped marker. `hertz` is the
    speed of the online labelling on one core, by CPU time.
    """
    made = _synthesise(scene, motion, seed, frames)
    started = find_start(made.capture, made.models)
    models = sized_models(made.models, started)
    paper = variant == "paper"
    found = fit_poses(label_from(made.capture, models, started, PAPER_LABELLING if paper else LabellingOptions()))
    true = fit_poses(replace(found, columns=made.truth.columns))
    hands = [k for k, model in enumerate(models) if not model.is_rigid]
    errors = [
        AngleErrors.between(found.poses[k], true.poses[k], true.columns[k] >= 0, np.asarray(models[k].bodies))
        for k in hands
    ]
    degrees, seen = (np.concatenate(parts) for parts in zip(*((e.degrees, e.seen) for e in errors), strict=True))
    return {
        "error_deg": _mean(degrees),
        "seen_deg": _mean(np.where(seen, degrees, np.nan)),
        "lost_frames": int(np.isnan(degrees).any(axis=1).sum()),
        "right_labels": _right_share(found, true),
        "hertz": len(made.capture) / _online_seconds(made.capture, models, started, paper),
    }


def _synthesise(scene: str, motion: str, seed: int, frames: int) -> SyntheticMarkers:
    """Return a trial that begins anywhere in the motion."""
    duration = load_motion(motion).duration or 0.0
    latest = max(duration - frames / RATE, 0.0)
    start = round(float(np.random.default_rng(seed).uniform(0, latest)), 3)
    options = MarkerSynthesis(motion=motion, layout="26", start=start, frames=frames, rate=RATE, seed=seed)
    if scene == "scene":
        options = replace(options, layout="13", two_hands=True, rigid_bodies=3, rigid_markers=3)
    return synthesise_markers(options)


def _online_seconds(
    capture: MarkerCapture, models: Sequence[MarkerModel], started: StartedModels, paper: bool
) -> float:
    """Return the CPU time of the online labelling, seconds, after a call that compiles."""
    options = PAPER_LABELLING if paper else LabellingOptions(offline=OfflineOptions(use=False))
    seconds = 0.0
    for _ in range(2):
        begun = process_time()
        label_from(capture, models, started, options)
        seconds = process_time() - begun
    return seconds


def _right_share(found: LabelledCapture, true: LabelledCapture) -> float:
    """Return the share of the samples with a true label that have it."""
    pairs = list(zip(found.columns, true.columns, strict=True))
    right = sum(int(((given == wanted) & (wanted >= 0)).sum()) for given, wanted in pairs)
    return right / sum(int((wanted >= 0).sum()) for _, wanted in pairs)


def _mean(values: Array) -> float | None:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else None


def tabulate(rows: Sequence[Row]) -> list[Row]:
    names = ("scene", "motion", "seed", "error_deg", "seen_deg", "lost_frames", "right_labels", "hertz")
    return [{name: row[name] for name in names} for row in rows]


def _trials(rows: Sequence[Row], name: str) -> Array:
    """Return a value of the trials of one hand, without those that have none."""
    return np.array([row[name] for row in rows if row["scene"] == "hand" and row[name] is not None])


def compare(rows: Sequence[Row]) -> list[PaperComparison]:
    error, seen = _trials(rows, "error_deg"), _trials(rows, "seen_deg")
    hertz = {scene: [row["hertz"] for row in rows if row["scene"] == scene] for scene in SCENES}

    def of(function: Callable[[Array], Any], values: Sequence[float] | Array) -> float | None:
        return float(function(np.asarray(values))) if len(values) else None

    return [
        PaperComparison("trials", "1126", float(len(error)), ""),
        PaperComparison("difference of angles, mean of the trials", f"{PAPER_DEG:g} deg", of(np.mean, error), "deg"),
        PaperComparison("standard deviation of the trials", f"{PAPER_SD_DEG:g} deg", of(np.std, error), "deg"),
        PaperComparison("median of the trials", "not given", of(np.median, error), "deg"),
        PaperComparison("difference, fingers without dropped markers", "not given", of(np.mean, seen), "deg"),
        PaperComparison(
            "samples with a wrong or no label", "not given", of(np.mean, 100 - 100 * _trials(rows, "right_labels")), "%"
        ),
        *(
            PaperComparison(f"frames per second, {words}", f"{PAPER_HERTZ[scene]:g}", of(np.median, hertz[scene]), "Hz")
            for scene, words in SCENES.items()
        ),
    ]


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    errors = np.maximum(_trials(rows, "error_deg"), _LEAST_DEG)
    bins = np.geomspace(_LEAST_DEG, max(10 * PAPER_DEG, float(errors.max(initial=PAPER_DEG)) * 1.1), 30)
    axes.hist(errors, bins=bins.tolist(), color="C0", label="ours, trials")
    axes.axvline(PAPER_DEG, color="C1", linestyle="--", label="paper, mean")
    if len(errors):
        axes.axvline(float(_trials(rows, "error_deg").mean()), color="C0", label="ours, mean")
    axes.set(xscale="log", xlabel="mean difference of the joint angles in a trial (deg)", ylabel="trials")
    axes.legend(loc="upper right")


EXPERIMENT = Experiment(
    name="maycock-6",
    title="Joint angles from automatic labels, against true labels",
    source="Maycock, Roehlig, Schroeder, Botsch and Ritter 2015, Fig. 6 and Sec. V",
    cells=cells,
    measure=label_trial,
    tabulate=tabulate,
    compare=compare,
    draw=draw,
)

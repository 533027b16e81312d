"""`depthtrack bench starts`: share of right starts (Maycock et al. 2015, Sec. III-A).

A start is right if every marker has its point, and markers that were not measured have none. Synthetic frames are of
subjects with sizes and marker places of their own. Recorded captures are stripped of their labels, and the points of
each frame are shuffled.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np

from depthtrack.errors import InputError
from depthtrack.hand.shape import HandShape, Side
from depthtrack.machine import Machine, describe_machine
from depthtrack.markers.formats.registry import read_capture
from depthtrack.markers.initialisation.options import InitialisationOptions
from depthtrack.markers.initialisation.paper import initialise_as_paper
from depthtrack.markers.initialisation.search import ModelSearch, started_models
from depthtrack.markers.initialisation.started import StartedModel
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.markers.models.model_choice import choose_models
from depthtrack.markers.named_labels import labels_by_name
from depthtrack.synthesis.marker_capture import MarkerSynthesis, synthesise_markers
from depthtrack.synthesis.motion import load_motion
from depthtrack.text_table import aligned
from depthtrack.types import Array, Index

MOTIONS = ("everyday", "grasp", "random")
CONDITIONS = {"complete": (0, 0.0), "5 ghosts": (5, 0.0), "2 ghosts, 10 % missing": (2, 0.1)}
"""Number of ghosts and share of missing markers, by name."""
TOUCHING = "two hands touch, 2 ghosts, 10 % missing"
"""Condition of the last row of a layout."""
SURE = 0.9
"""Confidence from which on a start counts as sure."""
_PLACEMENT, _NOISE = 0.003, 0.0005
"""Standard deviation of the subject's markers about the layout, and of the points, metres each axis."""
_GHOSTS_WITHIN = 0.15
"""Largest distance of a ghost from the centre of the markers along each axis, metres."""
_LONGEST = 5.0
"""Time in a random motion that frames are taken from, seconds."""
_TOUCH, _TOUCH_RATE = 1.25, 20.0
"""Time from the first frame of a capture to the middle of a touch, seconds, and rate of the frames, Hz."""


@dataclass(frozen=True)
class StartsPlan:
    """What to measure.

    layouts: names of layouts for synthetic frames.
    trials: synthetic frames a row, or frames of a capture.
    seed: of the first trial; each has the next one.
    capture: recorded capture with labels, in place of synthetic frames; models: those to find in it.
    """

    layouts: tuple[str, ...]
    trials: int
    seed: int
    capture: Path | None = None
    models: tuple[MarkerModel, ...] = ()

    @property
    def row_count(self) -> int:
        """Number of rows of the report."""
        return len(self.layouts) * (len(CONDITIONS) + 1) if self.capture is None else len(self.models)


@dataclass(frozen=True)
class StartsRow:
    """Starts of one model under one condition.

    right: share of right starts. markers: share of markers with the right point, or rightly none.
    sure: share of starts of at least the confidence `SURE`; sure_right: share of right ones among them, None if none.
    wrong_margin: largest margin of a wrong start, None if none.
    paper: share of right starts by the paper's method.
    seconds: mean time of a start of all models.
    """

    model: str
    condition: str
    trials: int
    right: float
    markers: float
    sure: float
    sure_right: float | None
    wrong_margin: float | None
    paper: float
    seconds: float


@dataclass(frozen=True)
class StartsReport:
    """Rows and the machine that they were measured on."""

    machine: Machine
    seed: int
    rows: tuple[StartsRow, ...]


@dataclass(frozen=True)
class _Trial:
    found: StartedModel | None
    by_paper: StartedModel | None
    truth: Index
    seconds: float


def plan(
    layouts: tuple[str, ...], trials: int, seed: int, capture: Path | None = None, models: tuple[str, ...] = ()
) -> StartsPlan:
    """Return a checked plan.

    Raises:
        InputError: if there are no trials, or a capture comes without models.
    """
    if trials < 1:
        raise InputError(f"starts need at least 1 trial, found {trials}")
    return StartsPlan(layouts, trials, seed, capture, () if capture is None else choose_models(models))


def run(
    plan: StartsPlan, progress: Callable[[Iterator[StartsRow]], Iterable[StartsRow]] = lambda rows: rows
) -> StartsReport:
    """Return the measurements of a plan.

    Raises:
        InputError: if a layout is unknown, or the capture is damaged or lacks labels of a model.
    """
    rows = _synthetic_rows(plan) if plan.capture is None else _recorded_rows(plan, plan.capture)
    return StartsReport(describe_machine(), plan.seed, tuple(progress(rows)))


def as_text(report: StartsReport) -> str:
    """Return the report as a table."""
    head = ("model", "points", "trials", "right", "markers", "sure", "right if sure", "wrong margin", "paper", "time")
    rows = [
        (
            row.model,
            row.condition,
            str(row.trials),
            f"{row.right:.1%}",
            f"{row.markers:.2%}",
            f"{row.sure:.0%}",
            "-" if row.sure_right is None else f"{row.sure_right:.1%}",
            "-" if row.wrong_margin is None else f"{row.wrong_margin:.1f}",
            f"{row.paper:.1%}",
            f"{row.seconds:.2f} s",
        )
        for row in report.rows
    ]
    return "\n".join(aligned([head, *rows], left=2))


def _synthetic_rows(plan: StartsPlan) -> Iterator[StartsRow]:
    options = InitialisationOptions()
    for layout in plan.layouts:
        searches = {side: ModelSearch.of(_worn(layout, side), options.search) for side in ("right", "left")}
        for condition, (ghosts, missing) in CONDITIONS.items():
            trials = []
            for seed in range(plan.seed, plan.seed + plan.trials):
                side: Side = "left" if seed // len(MOTIONS) % 2 else "right"
                points, truth = synthetic_frame(seed, layout, side, ghosts, missing)
                trials += _trials([searches[side]], points, [truth], options)
            yield _row(layout, condition, trials)
        trials = []
        for seed in range(plan.seed, plan.seed + plan.trials):
            points, truths = touching_frame(seed, layout, *CONDITIONS["2 ghosts, 10 % missing"])
            trials += _trials([searches["right"], searches["left"]], points, truths, options)
        yield _row(layout, TOUCHING, trials)


def _worn(layout: str, side: Side) -> MarkerModel:
    return choose_models([f"{side}:{layout}"])[0]


def synthetic_frame(seed: int, layout: str, side: Side, ghosts: int, missing: float) -> tuple[Array, Index]:
    """Return shuffled points (K, 3), metres, and the point (M,) of each marker, -1 for none.

    ghosts: number of points that are no marker. missing: probability that a marker is not measured.
    """
    rng, motion = np.random.default_rng(seed), MOTIONS[seed % len(MOTIONS)]
    time = rng.uniform(0, load_motion(motion).duration or _LONGEST)
    hand = HandShape(side=side)
    made = synthesise_markers(
        MarkerSynthesis(motion, layout, hand, start=0.9 * time, frames=1, placement=_PLACEMENT, seed=seed)
    )
    points, (truth,) = _measured(rng, [made.positions[0][0]], ghosts, missing)
    return points, truth


def touching_frame(seed: int, layout: str, ghosts: int, missing: float) -> tuple[Array, list[Index]]:
    """Return points as `synthetic_frame` does, of a right and a left hand that touch."""
    rng, motion = np.random.default_rng(seed), MOTIONS[seed % len(MOTIONS)]
    frame = round(_TOUCH * _TOUCH_RATE)
    latest = (load_motion(motion).duration or _LONGEST) - _TOUCH
    made = synthesise_markers(
        MarkerSynthesis(
            motion,
            layout,
            two_hands=True,
            touching=True,
            start=0.9 * rng.uniform(0, latest),
            frames=frame + 1,
            rate=_TOUCH_RATE,
            placement=_PLACEMENT,
            seed=seed,
        )
    )
    return _measured(rng, [positions[frame] for positions in made.positions], ghosts, missing)


def _measured(rng: np.random.Generator, hands: list[Array], ghosts: int, missing: float) -> tuple[Array, list[Index]]:
    """Return shuffled points (K, 3) with ghosts, and the point (M,) of each marker of each hand."""
    exact = np.concatenate(hands)
    markers = exact + rng.normal(0, _NOISE, exact.shape)
    seen = rng.random(len(markers)) >= missing
    clutter = markers.mean(axis=0) + rng.uniform(-_GHOSTS_WITHIN, _GHOSTS_WITHIN, (ghosts, 3))
    points = np.concatenate([markers[seen], clutter])
    order = rng.permutation(len(points))
    truth = np.full(len(markers), -1)
    truth[seen] = np.argsort(order)[: seen.sum()]
    return points[order], np.split(truth, np.cumsum([len(hand) for hand in hands])[:-1])


def _recorded_rows(plan: StartsPlan, path: Path) -> Iterator[StartsRow]:
    capture, options = read_capture(path), InitialisationOptions()
    labelled = labels_by_name(capture, plan.models)
    if labelled is None:
        raise InputError(f"{path} lacks labels of {', '.join(model.name for model in plan.models)[:80]}")
    searches = [ModelSearch.of(model, options.search) for model in plan.models]
    rng, trials = np.random.default_rng(plan.seed), []
    for frame in np.linspace(0, len(capture) - 1, plan.trials).round().astype(int):
        points, columns = capture.points(frame)
        order = rng.permutation(len(points))
        number = np.full(len(capture.labels) + 1, -1)
        number[columns[order]] = np.arange(len(points))
        trials.append(_trials(searches, points[order], [number[c[frame]] for c in labelled.columns], options))
    for k, model in enumerate(plan.models):
        yield _row(model.name, path.stem, [frame[k] for frame in trials])


def _trials(
    searches: list[ModelSearch], points: Array, truths: list[Index], options: InitialisationOptions
) -> list[_Trial]:
    """Return the starts of all models in a frame."""
    begin = perf_counter()
    found = started_models(searches, points)
    seconds = perf_counter() - begin
    paper = initialise_as_paper(points, tuple(search.fitter.model for search in searches), options.paper)
    return [_Trial(*each, seconds) for each in zip(found, paper, truths, strict=True)]


def _row(model: str, condition: str, trials: list[_Trial]) -> StartsRow:
    right = np.array([_is_right(t.found, t.truth) for t in trials])
    sure = np.array([t.found is not None and t.found.confidence >= SURE for t in trials])
    margins = [t.found.margin for t, ok in zip(trials, right, strict=True) if t.found is not None and not ok]
    return StartsRow(
        model,
        condition,
        len(trials),
        float(right.mean()),
        float(np.mean([0.0 if t.found is None else np.mean(t.found.points == t.truth) for t in trials])),
        float(sure.mean()),
        float(right[sure].mean()) if sure.any() else None,
        max(margins) if margins else None,
        float(np.mean([_is_right(t.by_paper, t.truth) for t in trials])),
        float(np.mean([t.seconds for t in trials])),
    )


def _is_right(started: StartedModel | None, truth: Index) -> bool:
    return started is not None and bool(np.array_equal(started.points, truth))

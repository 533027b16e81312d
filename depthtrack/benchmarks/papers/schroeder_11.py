"""Fig. 11 of Schroeder et al. 2014: signs from single frames, with and without hierarchy."""

from collections.abc import Sequence
from contextlib import closing
from functools import lru_cache
from time import process_time
from typing import Literal

import numpy as np
from matplotlib.axes import Axes

from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.benchmarks.papers.schroeder import SCHROEDER_2014
from depthtrack.benchmarks.papers.synergy_sources import load_source, resolve_name
from depthtrack.errors import InputError
from depthtrack.evaluation.metrics import angle_error, endpoint_error
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import ANGLES
from depthtrack.hand.synergies import Synergies
from depthtrack.rendering.options import ScoringOptions
from depthtrack.solver.options import PAPER_ICP, IcpOptions, SurfaceFitOptions
from depthtrack.synthesis.generate import Synthesis
from depthtrack.synthesis.observations import ObservedMotion, observed_motion
from depthtrack.tracking.frame import Toolkit
from depthtrack.tracking.stages.coarse_to_fine import (
    DIRECT,
    PAPER_COARSE_TO_FINE,
    CoarseToFine,
    estimate_single_frame,
)
from depthtrack.types import Array

Way = Literal["hierarchical", "all angles at once"]

MOTION = "signs"
OTHERS = "signs but this one"
"""Name of the synergies of the motion without the frames between the sign before and the sign after."""
SEEDS = 5
"""Number of repetitions; our hierarchy starts from random postures, that of the paper from the mean one."""
PAPER_DEG: dict[Way, float] = {"hierarchical": 0.4, "all angles at once": 22.0}
"""Errors in the text of the paper, which also gives about 10 s per frame."""
_SHORTEST_HOLD = 5
"""Smallest number of frames with the same posture in which a sign is held."""


def cells(options: ExperimentOptions) -> list[Cell]:
    """Return the cells of all signs; only random methods are repeated."""
    name = resolve_name(options.synergies, MOTION)
    ways: list[tuple[Way, str]] = [("hierarchical", name), ("all angles at once", name)]
    if name == MOTION:
        ways.insert(1, ("hierarchical", OTHERS))
    is_random = options.variant == "default"
    return [
        {"sign": number, "way": way, "synergies": which, "variant": options.variant, "repetition": seed}
        for number in range(len(_signs(options.frames)))
        for way, which in ways
        for seed in (options.seeds(SEEDS, 1) if is_random and way == "hierarchical" else range(1))
    ]


def measure(*, sign: int, way: Way, synergies: str, variant: Literal["default", "paper"], repetition: int) -> Row:
    """Estimate the posture of a sign from the middle frame of its hold and the true global pose.

    All points are used. The errors are those of `schroeder.track_motion`; `s_per_frame` is the CPU time, point cloud
    included.
    """
    motion, holds = _motion(None), _signs(None)
    frame = sum(holds[sign]) // 2
    known = _without(sign) if synergies == OTHERS else load_source(synergies).synergies
    coarse_to_fine = (
        DIRECT if way == "all angles at once" else PAPER_COARSE_TO_FINE if variant == "paper" else CoarseToFine()
    )
    fit = SurfaceFitOptions(subsample=1, icp=PAPER_ICP if variant == "paper" else IcpOptions())
    _compile()
    with closing(Toolkit(motion.hand, ScoringOptions(), synergies=known)) as tools:
        observation, begun = motion.uncached(frame), process_time()
        pose = estimate_single_frame(tools, observation, motion.poses[frame], coarse_to_fine, fit, repetition).pose
        seconds = process_time() - begun
    hand, pose, true = HandModel(motion.hand), pose[None], motion.poses[[frame]]
    return {
        "frame": frame,
        "error_deg": float(angle_error(pose, true).values[0]),
        "error_mm": float(endpoint_error(hand, pose, hand, true).values[0]),
        "s_per_frame": seconds,
    }


def static_intervals(poses: Array) -> list[tuple[int, int]]:
    """Return the first and last frame of each interval in which the pose is constant.

    poses: (T, 27).
    """
    still = np.abs(np.diff(poses, axis=0)).max(axis=1) < 1e-9
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2) if b - a >= _SHORTEST_HOLD]


def _motion(frames: int | None) -> ObservedMotion:
    return observed_motion(Synthesis(motion=MOTION, model="skin", frames=frames))


def _signs(frames: int | None) -> list[tuple[int, int]]:
    found = static_intervals(_motion(frames).poses)
    if not found:
        raise InputError(f"the first {frames} frames of {MOTION} contain no sign: give --frames 25 or more")
    return found


def _without(sign: int) -> Synergies:
    """Return synergies of the motion without a sign and the transitions around it."""
    poses, holds = _motion(None).poses, _signs(None)
    first = holds[sign - 1][1] + 1 if sign > 0 else 0
    last = holds[sign + 1][0] if sign + 1 < len(holds) else len(poses)
    return Synergies.fit(np.delete(poses[:, ANGLES], np.s_[first:last], axis=0), OTHERS)


@lru_cache(maxsize=1)
def _compile() -> None:
    """Compile the kernels, so that no timed frame does."""
    motion = _motion(None)
    for coarse_to_fine, icp in ((CoarseToFine(), IcpOptions()), (PAPER_COARSE_TO_FINE, PAPER_ICP)):
        fit = SurfaceFitOptions(subsample=50, icp=icp)
        with closing(Toolkit(motion.hand, ScoringOptions(), synergies=load_source(MOTION).synergies)) as tools:
            estimate_single_frame(tools, motion.uncached(0), motion.poses[0], coarse_to_fine, fit)


def tabulate(rows: Sequence[Row]) -> list[Row]:
    """Return one line per method and synergies, over all signs and repetitions."""
    table = []
    for way, synergies in dict.fromkeys((row["way"], row["synergies"]) for row in rows):
        mine = [row for row in rows if (row["way"], row["synergies"]) == (way, synergies)]
        errors = np.array([row["error_deg"] for row in mine])
        table.append(
            {
                "way": way,
                "synergies": synergies,
                "estimates": len(mine),
                "error_deg": float(errors.mean()),
                "median_deg": float(np.median(errors)),
                "worst_deg": float(errors.max()),
                "within_1_deg_percent": 100 * float(np.mean(errors <= 1)),
                "error_mm": float(np.mean([row["error_mm"] for row in mine])),
                "s_per_frame": float(np.median([row["s_per_frame"] for row in mine])),
            }
        )
    return table


def compare(rows: Sequence[Row]) -> list[PaperComparison]:
    lines = {(line["way"], line["synergies"] == OTHERS): line for line in tabulate(rows)}

    def ours(name: str, way: Way, others: bool = False) -> float | None:
        return lines[way, others][name] if (way, others) in lines else None

    return [
        PaperComparison("joint angle error, hierarchical", "about 0.4 deg", ours("error_deg", "hierarchical"), "deg"),
        PaperComparison(
            "joint angle error, all angles at once", "about 22 deg", ours("error_deg", "all angles at once"), "deg"
        ),
        PaperComparison(
            "time of a frame, hierarchical (ours: one core)",
            "about 10 s (8 threads)",
            ours("s_per_frame", "hierarchical"),
            "s",
        ),
        PaperComparison("endpoint error, hierarchical", "not given", ours("error_mm", "hierarchical"), "mm"),
        PaperComparison(
            "joint angle error, synergies without the sign",
            "not given",
            ours("error_deg", "hierarchical", others=True),
            "deg",
        ),
        PaperComparison("hierarchical, median", "not given", ours("median_deg", "hierarchical"), "deg"),
        PaperComparison("hierarchical, maximum", "not given", ours("worst_deg", "hierarchical"), "deg"),
    ]


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    """Draw the median and the range over the repetitions of each sign."""
    labels = {
        ("all angles at once", False): ("C1", "s", "all angles at once"),
        ("hierarchical", True): ("C2", "^", "hierarchical, synergies of the other signs"),
        ("hierarchical", False): ("C0", "o", "hierarchical"),
    }
    for (way, others), (colour, marker, label) in labels.items():
        mine = [row for row in rows if (row["way"], row["synergies"] == OTHERS) == (way, others)]
        signs = sorted({row["sign"] for row in mine})
        errors = [[row["error_deg"] for row in mine if row["sign"] == sign] for sign in signs]
        if signs:
            axes.vlines(np.array(signs) + 1, [min(e) for e in errors], [max(e) for e in errors], color=colour, lw=1)
            middle = [float(np.median(e)) for e in errors]
            axes.plot(np.array(signs) + 1, middle, marker, color=colour, label=f"ours, {label}")
        if not others:
            paper = PAPER_DEG["hierarchical" if way == "hierarchical" else "all angles at once"]
            axes.axhline(paper, color=colour, linestyle="--", lw=1, label=f"paper, mean, {label}")
    axes.set(xlabel="sign", ylabel="joint angle error (deg)", yscale="log", ylim=(0.05, 300))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.legend(ncols=2, loc="upper right")


EXPERIMENT = Experiment(
    name="schroeder-11",
    title="Signs from single frames, with and without hierarchy",
    source=f"{SCHROEDER_2014}, Fig. 11",
    cells=cells,
    measure=measure,
    tabulate=tabulate,
    compare=compare,
    draw=draw,
)

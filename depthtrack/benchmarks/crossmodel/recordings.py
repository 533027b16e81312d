"""Recordings of the cross-model benchmark.

The hand is a rigged mesh of another make. Without one, it is the skin with sizes drawn from their prior, which the
trackers do not know.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from depthtrack.benchmarks.papers.experiment import ExperimentOptions
from depthtrack.errors import InputError
from depthtrack.evaluation.sweep.rows import Cell
from depthtrack.hand.hand_file import load_hand
from depthtrack.hand.shape import HandShape, Side
from depthtrack.recording.registry import open_sequence
from depthtrack.recording.sequence import Sequence
from depthtrack.synthesis.generate import SensorName, Synthesis, Synthesiser, write_recording
from depthtrack.synthesis.random_hand import random_hand

MOTIONS = ("everyday", "signs", "grasp", "other-grasps", "fast", "random")
SENSORS: tuple[SensorName, ...] = ("kinect1", "kinect2", "realsense")
SCALES = (0.8, 1.2)
"""Range of the scales of rigged hands."""
FRAMES, QUICK_FRAMES = 180, 60
SEEDS, QUICK_SEEDS = 5, 1
FIRST_SEED = {"tuning": 0, "report": 1000}
"""First seed of each split; thresholds are tuned on the one, and figures come from the other."""


def recording_cells(options: ExperimentOptions) -> list[Cell]:
    """Return one cell per motion and seed: a recording of a random hand, sensor and viewpoint.

    Raises:
        InputError: the seeds reach those of the other split.
    """
    if options.split == "tuning" and (last := options.seeds(SEEDS, QUICK_SEEDS)[-1]) >= FIRST_SEED["report"]:
        raise InputError(f"seeds of the split tuning must be below {FIRST_SEED['report']}, found {last}")
    rigs = [(str(Path(rig).resolve()), load_hand(Path(rig)).side) for rig in options.rigs]
    first = FIRST_SEED[options.split]
    return [
        _drawn(motion, first + seed, rigs) | {"frames": options.frames or (QUICK_FRAMES if options.quick else FRAMES)}
        for seed in options.seeds(SEEDS, QUICK_SEEDS)
        for motion in MOTIONS
    ]


def _drawn(motion: str, seed: int, rigs: list[tuple[str, Side]]) -> Cell:
    """Return the random choices of a recording.

    rigs: path and side of each rig; hands are drawn from the prior if there are none.
    """
    draw = np.random.Generator(np.random.Philox(key=[seed, MOTIONS.index(motion)]))
    hands: list[tuple[str | None, Side]] = [*rigs] or [(None, "right"), (None, "left")]
    rig, side = hands[draw.integers(len(hands))]
    return {
        "motion": motion,
        "seed": seed,
        "sensor": SENSORS[draw.integers(len(SENSORS))],
        "side": side,
        "scale": round(float(draw.uniform(*SCALES)), 2),
        "viewpoint": int(draw.integers(5)),
        "rig": rig,
    }


@contextmanager
def made_recording(
    *,
    motion: str,
    seed: int,
    sensor: SensorName,
    side: Side,
    scale: float,
    viewpoint: int,
    rig: str | None,
    frames: int,
) -> Iterator[Sequence]:
    """Yield the recording of a cell, written to a temporary folder.

    Raises:
        InputError: if the rig cannot be read, or has no hand of the side.
    """
    hand = random_hand(side, scale, seed) if rig is None else _scaled(rig, side, scale)
    options = Synthesis(
        motion, viewpoint=viewpoint, hand=hand, model="skin", background="room", sensor=sensor, seed=seed
    )
    whole = Synthesiser(options)
    made = Synthesiser(replace(options, frames=min(frames, len(whole))))
    with TemporaryDirectory(prefix="depthtrack-crossmodel-") as folder:
        path = Path(folder) / f"{motion}-{seed}"
        write_recording(made, path)
        yield open_sequence(path)


def _scaled(rig: str, side: Side, scale: float) -> HandShape:
    hand = load_hand(Path(rig), side)
    # A rig has proportions of its own, and its scale.
    return hand.with_(scale=hand.scale * scale)

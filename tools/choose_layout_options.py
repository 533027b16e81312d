"""Choose the default options of marker layouts on motions that no reported figure uses.

    python tools/choose_layout_options.py swarm
    python tools/choose_layout_options.py motions
    python tools/choose_layout_options.py capture FOLDER    # a folder of `markers solve`: the glove of docs/markers.md

`swarm` compares swarms and exchanges with the greedy choice. `motions` and `capture` print the errors of both
objectives for several standard deviations. Each tuning motion is tested with synergies and layouts of the others.
Reported test motions are `grasp` and `other-grasps`, the reported capture is another one.
"""

import sys
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path
from time import process_time

import numpy as np

from depthtrack.benchmarks.papers.schroeder2015 import motion_poses, training_postures
from depthtrack.hand.pose import ANGLES
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.markers.folder.reading import MarkerFolder
from depthtrack.markers.layout.candidates import Candidates
from depthtrack.markers.layout.capture_comparison import HeldOutHalf, best_choice, random_choice
from depthtrack.markers.layout.exchange import greedy_layout, kicked
from depthtrack.markers.layout.options import ExpectedOptions, QualityOptions
from depthtrack.markers.layout.quality import LayoutQuality
from depthtrack.markers.layout.reconstruction import ReconstructionOptions, reconstruct
from depthtrack.markers.layout.surface_swarm import swarm_layout
from depthtrack.solver.options import SwarmOptions
from depthtrack.types import Array

MARKERS = (4, 6, 8, 10)
TUNING = ("everyday", "signs", "random")
RANDOM_SEEDS = (10, 11, 12, 13)
TEST_SEED = 14
RESIDUALS = (0.0003, 0.0005, 0.001, 0.002, 0.004)
BEYOND = (0.0175, 0.035, 0.087)
DAMPINGS = (1e-7, 1e-6, 1e-5, 1e-4)
SWARMS = ((50, 20), (100, 40), (200, 50), (400, 60), (1000, 100))
KICKS = (0, 3, 10, 20)
SWARM_TRAININGS = ("interaction", "interaction-2", "signs")
SWARM_MARKERS = (4, 6, 8, 10, 12)
SWARM_SEEDS = (100, 101)
DRAWS = 30


def objectives() -> Iterator[tuple[str, QualityOptions]]:
    """Return the objectives to compare by name."""
    yield "condition", QualityOptions(objective="condition")
    for residual, beyond in product(RESIDUALS, BEYOND):
        options = ExpectedOptions(residual=residual, beyond=beyond)
        yield f"expected {1000 * residual:g} mm {beyond:g} rad", QualityOptions(expected=options)


def reconstructions() -> Iterator[tuple[str, ReconstructionOptions]]:
    """Return the reconstructions to compare by name."""
    for damping in DAMPINGS:
        yield f"free refinement {damping:g}", ReconstructionOptions(method="subspace", damping=damping)
    for residual, beyond in product(RESIDUALS, BEYOND):
        yield f"prior {1000 * residual:g} mm {beyond:g} rad", ReconstructionOptions(residual=residual, beyond=beyond)


def swarm() -> None:
    """Print how often a swarm with exchanges is below or above the greedy choice."""
    candidates = Candidates.on_skin(HandShape())
    found: dict[tuple[int, int, int], list[tuple[float, float]]] = {}
    greedy_times = []
    for training, count in product(SWARM_TRAININGS, SWARM_MARKERS):
        options = QualityOptions(objective="condition", components=min(6, count))
        quality = LayoutQuality.of(candidates, training_postures(training), options)
        begun = process_time()
        greedy = greedy_layout(quality, count)
        greedy_times.append(process_time() - begun)
        for (particles, generations), seed in product(SWARMS, SWARM_SEEDS):
            generator = np.random.Generator(np.random.Philox(key=[seed, count]))
            begun = process_time()
            size = SwarmOptions(particles=particles, generations=generations)
            rows, spent = swarm_layout(quality, count, generator, size).rows, process_time() - begun
            for kicks in range(1 + max(KICKS)):
                begun = process_time()
                best = kicked(quality, rows, min(kicks, 1), generator)
                rows, spent = best.rows, spent + process_time() - begun
                if kicks in KICKS:
                    row = (best.energy - greedy.energy) / abs(greedy.energy), spent
                    found.setdefault((particles, generations, kicks), []).append(row)
    print(f"greedy: {np.median(greedy_times):.3f} s median, {np.max(greedy_times):.3f} s longest")
    for (particles, generations, kicks), pairs in found.items():
        change, seconds = np.array(pairs).T
        print(
            f"{particles} x {generations}, {kicks} changes: better {100 * np.mean(change < -1e-9):.0f} %,"
            f" worse {100 * np.mean(change > 1e-9):.0f} %, {np.median(seconds):.3f} s median, {seconds.max():.3f} s"
        )


def motions() -> None:
    """Print the mean errors, mm, of exact markers on tuning motions."""
    hand = HandShape()
    candidates, skin = Candidates.on_skin(hand), Skin.of(hand)
    poses = {name: motion_poses(name) for name in TUNING[:2]}
    poses["random"] = np.concatenate([motion_poses("random", seed) for seed in RANDOM_SEEDS])
    errors: dict[tuple[str, str], list[float]] = {}
    for test, count in product(TUNING, MARKERS):
        truth = (motion_poses("random", TEST_SEED) if test == "random" else poses[test])[::3]
        vertices = skin.at(truth[::4])
        known = np.concatenate([poses[name][:, ANGLES] for name in TUNING if name != test])
        for name, options in objectives():
            quality = LayoutQuality.of(candidates, known, replace(options, components=min(6, count)))
            rows = kicked(quality, greedy_layout(quality, count).rows, 2, np.random.default_rng(0)).rows
            model = candidates.layout(rows, name).on(hand)
            positions, wrist = model.positions(truth), model.kinematics.wrist(truth)
            for method, inverse in reconstructions():
                inverse = replace(inverse, components=min(6, count))
                found = reconstruct(model, positions, quality.synergies, inverse, wrist)
                error = np.linalg.norm(skin.at(found[::4]) - vertices, axis=-1).mean()
                errors.setdefault((name, method), []).append(1000 * float(error))
    _print(errors)


def capture(folder: Path) -> None:
    """Print the mean errors, mm, at the markers left out, in both halves of a solved capture."""
    labelled = MarkerFolder.load(folder).labelled
    errors: dict[tuple[str, str], list[float]] = {}
    halves = [HeldOutHalf.of(labelled, 0, half, every=16) for half in ("first", "second")]
    for half, count in product(halves, MARKERS):
        generator = np.random.Generator(np.random.Philox(key=[0, count]))
        draws = [random_choice(len(half.candidates), count, generator) for _ in range(DRAWS)]
        chosen = {name: best_choice(half.quality(count, options), count, 0) for name, options in objectives()}
        for method, inverse in reconstructions():
            mean = float(np.mean([half.measured(rows, inverse).error for rows in draws]))
            errors.setdefault(("random choices", method), []).append(1000 * mean)
            for name, rows in chosen.items():
                errors.setdefault((name, method), []).append(1000 * half.measured(rows, inverse).error)
    _print(errors)


def _print(errors: dict[tuple[str, str], list[float]]) -> None:
    """Print the mean of each pair, least first."""
    for (name, method), values in sorted(errors.items(), key=lambda item: float(np.mean(item[1]))):
        each: Array = np.array(values).reshape(-1, len(MARKERS)).mean(axis=0)
        print(f"{np.mean(values):6.2f}   {'  '.join(f'{v:.2f}' for v in each)}   {name}; {method}")


if __name__ == "__main__":
    if sys.argv[1:] == ["swarm"]:
        swarm()
    elif sys.argv[1:] == ["motions"]:
        motions()
    elif len(sys.argv) == 3 and sys.argv[1] == "capture":
        capture(Path(sys.argv[2]))
    else:
        raise SystemExit(__doc__)

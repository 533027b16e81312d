"""Motions, layouts and errors of the experiments of Schroeder et al. 2015.

Test motions are never among the training data. Markers and wrist are exact, as in the paper.
"""

from dataclasses import replace
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np

from depthtrack.benchmarks.papers.experiment import ExperimentOptions
from depthtrack.benchmarks.papers.synergy_sources import load_source
from depthtrack.hand.pose import ANGLES
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.hand.synergies import Synergies
from depthtrack.markers.layout.candidates import Candidates
from depthtrack.markers.layout.expected_error import VertexErrors
from depthtrack.markers.layout.options import LayoutOptions, Objective, QualityOptions
from depthtrack.markers.layout.quality import LayoutQuality
from depthtrack.markers.layout.reconstruction import Method, ReconstructionOptions, reconstruct
from depthtrack.markers.layout.search import find_layout_of
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.solver.options import SwarmOptions
from depthtrack.synthesis.motion import frame_times, load_motion
from depthtrack.types import Array

SCHROEDER_2015 = "Schroeder, Maycock and Botsch 2015"
RATE = 30.0
TRAINING = {
    "grasps": ("other-grasps",),
    "grasps-2": ("grasp",),
    "interaction": ("other-grasps", "everyday"),
    "interaction-2": ("grasp", "everyday"),
    "generic": ("everyday", "signs", "random"),
}
"""Motions of each training set."""
TEST = {"grasps": "grasp", "interaction": "grasp", "grasps-2": "other-grasps", "interaction-2": "other-grasps"}
"""Test motion of each set; both are those of `generic`."""
_RANDOM_SEEDS = range(4)

Search = Literal["full", "quick"]
System = Literal["paper", "ours"]
"""What chooses a layout and reconstructs from it: the paper's objective and free refinement, or ours with a prior."""
OBJECTIVE: dict[System, Objective] = {"paper": "condition", "ours": "expected"}
METHOD: dict[System, Method] = {"paper": "subspace", "ours": "prior"}


def search_of(options: ExperimentOptions) -> Search:
    """Return the effort of the search for a layout."""
    return "quick" if options.quick else "full"


def layout_options(search: Search) -> LayoutOptions:
    """Return the options of the search for layouts."""
    return LayoutOptions(kicks=2) if search == "quick" else LayoutOptions()


PAPER_SWARM = SwarmOptions(particles=1000, generations=100)
"""The swarm of the paper, Sec. 5.2."""


@lru_cache(maxsize=8)
def motion_poses(motion: str, seed: int = 0) -> Array:
    """Return the poses (T, 27) of a motion, scene frame."""
    loaded = load_motion(motion)
    return loaded.poses(frame_times(loaded, RATE, None), seed)


@lru_cache(maxsize=8)
def training_postures(name: str) -> Array:
    """Return the postures (N, 20) of a training set, or of a source of synergies."""
    if name not in TRAINING:
        source = load_source(name)
        return postures_of(source.synergies) if source.postures is None else source.postures
    parts = [
        motion_poses(motion, seed)[:, ANGLES]
        for motion in TRAINING[name]
        for seed in (_RANDOM_SEEDS if motion == "random" else range(1))
    ]
    return np.concatenate(parts)


def postures_of(synergies: Synergies, count: int = 1000) -> Array:
    """Return random postures (count, 20) that are normally distributed along the synergies."""
    generator = np.random.Generator(np.random.Philox(0))
    coefficients = generator.normal(size=(count, len(synergies))) * np.sqrt(synergies.variances)
    return synergies.angles(np.clip(coefficients, synergies.lower, synergies.upper))


@lru_cache(maxsize=64)
def quality_of(training: str, markers: int, system: System) -> LayoutQuality:
    """Return the objective for a training set, with as many synergies as markers, at most six."""
    options = QualityOptions(objective=OBJECTIVE[system])
    options = replace(options, components=min(options.components, markers))
    return LayoutQuality.of(Candidates.on_skin(HandShape()), training_postures(training), options)


@lru_cache(maxsize=128)
def best_model(training: str, markers: int, system: System, search: Search, seed: int = 0) -> MarkerModel:
    """Return the hand with the layout that is found for a training set."""
    quality = quality_of(training, markers, system)
    found = find_layout_of(quality, markers, layout_options(search), seed, threads=1)
    return quality.candidates.layout(found.rows, training).on(quality.candidates.hand)


class ReconstructionError(NamedTuple):
    """Distances of the vertices from the true ones, mm: mean and largest over the frames."""

    error_mm: float
    largest_mm: float


def reconstruction_error(
    model: MarkerModel, quality: LayoutQuality, motion: str, method: Method, every: int = 2
) -> ReconstructionError:
    """Return the error of a test motion that is reconstructed from the markers of a model.

    quality: of the training set; it has the synergies.
    every: frames from one whose vertices are compared to the next.
    """
    truth = motion_poses(motion)
    options = ReconstructionOptions(method=method, components=quality.options.components)
    wrist = model.kinematics.wrist(truth)
    poses = reconstruct(model, model.positions(truth), quality.synergies, options, wrist)
    errors = VertexErrors.between(Skin.of(HandShape()), poses[::every], truth[::every])
    return ReconstructionError(1000 * float(errors.mean.mean()), 1000 * float(errors.largest.max()))


def motions_tested(training: str) -> tuple[str, ...]:
    """Return the test motions of a training set."""
    return (TEST[training],) if training in TEST else ("grasp", "other-grasps")

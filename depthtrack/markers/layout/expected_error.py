"""Reconstruction error of all vertices of the skin (Schroeder et al. 2015, Sec. 4)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from depthtrack.errors import InputError
from depthtrack.hand.pose import make_pose
from depthtrack.hand.skin.mesh import Skin
from depthtrack.hand.synergies import Synergies
from depthtrack.markers.layout.reconstruction import ReconstructionOptions, reconstruct
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array

_FEWEST = 5
"""Postures of a motion from which on its last fifth is one posture or more."""
_HELD_OUT = 200
_FRAMES = 32
"""Frames whose vertices are in memory at a time."""


class VertexErrors(NamedTuple):
    """Distances of the vertices of reconstructed hands from the true ones, metres.

    mean: (T,) of each frame over all vertices.
    largest: (T,) of each frame.
    """

    mean: Array
    largest: Array

    @staticmethod
    def between(skin: Skin, poses: Array, truth: Array) -> "VertexErrors":
        """Return the errors of poses (T, 27)."""
        mean, largest = np.empty(len(poses)), np.empty(len(poses))
        for first in range(0, len(poses), _FRAMES):
            part = slice(first, first + _FRAMES)
            distance = np.linalg.norm(skin.at(poses[part]) - skin.at(truth[part]), axis=-1)
            mean[part], largest[part] = distance.mean(axis=1), distance.max(axis=1)
        return VertexErrors(mean, largest)


def expected_errors(
    model: MarkerModel, motions: Sequence[Array], components: int, anchored: bool, noise: float, seed: int = 0
) -> VertexErrors:
    """Return the errors of motions that are reconstructed from noisy markers.

    motions: postures (T, 20) of each, rad.
    components: synergies of the subspace. They are fitted to the first four fifths of each motion. The last fifth, at
        most `_HELD_OUT` frames, is reconstructed.
    anchored: whether the wrist is measured too.
    noise: standard deviation of each coordinate, metres.

    Raises:
        InputError: if each motion has fewer than `_FEWEST` postures, or the first four fifths are equal.
    """
    assert model.hand is not None
    longest = max(map(len, motions), default=0)
    if longest < _FEWEST:
        raise InputError(f"the simulated error needs a motion of {_FEWEST} postures or more, found {longest}")
    split = [max(1, 4 * len(postures) // 5) for postures in motions]
    known = np.concatenate([postures[:first] for postures, first in zip(motions, split, strict=True)])
    synergies, options = Synergies.fit(known), ReconstructionOptions(components=components)
    generator, found = np.random.Generator(np.random.Philox(key=[seed, 1])), []
    for postures, first in zip(motions, split, strict=True):
        held_out = postures[first:][:_HELD_OUT]
        if not len(held_out):
            continue
        truth = make_pose(np.zeros(3), [1.0, 0, 0, 0], held_out)
        markers, wrist = model.positions(truth), model.kinematics.wrist(truth)
        markers = markers + generator.normal(0, noise, markers.shape)
        wrist = wrist + generator.normal(0, noise, wrist.shape)
        poses = reconstruct(model, markers, synergies, options, wrist if anchored else None)
        found.append(VertexErrors.between(Skin.of(model.hand), poses, truth))
    return VertexErrors(np.concatenate([e.mean for e in found]), np.concatenate([e.largest for e in found]))

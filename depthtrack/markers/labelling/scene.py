"""All models of a capture in arrays that compiled kernels read."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BodyPoses, Chain, forward_kinematics
from depthtrack.hand.kinematics import MOVES
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array, Index, Mask


class Scene(NamedTuple):
    """The markers and kinematics of G models.

    first: (G + 1,) the markers of model g are `first[g]` to `first[g + 1] - 1`.
    body: (M,) body of each marker.
    local: (M, 3) metres, frame of the body.
    spread: (M,) metres, standard deviation of `local`.
    moves: (M, 20) whether a finger angle moves the marker.
    base, lengths, mirror: (G, 5, 3, 4), (G, 5, 3), (G,) the chains, see `Chain`.
    rigid: (G,) whether the model has no joints.
    """

    first: Index
    body: Index
    local: Array
    spread: Array
    moves: Mask
    base: Array
    lengths: Array
    mirror: Array
    rigid: Mask

    @staticmethod
    def of(models: Sequence[MarkerModel]) -> "Scene":
        """Return the arrays of some models."""
        body = np.concatenate([model.bodies for model in models])
        rigid = np.array([model.is_rigid for model in models])
        counts = [len(model.labels) for model in models]
        chains = [model.kinematics.chain for model in models]
        return Scene(
            first=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
            body=body,
            local=np.concatenate([model.offsets for model in models]),
            spread=np.concatenate([model.spread for model in models]),
            moves=MOVES[body] & ~np.repeat(rigid, counts)[:, None],
            base=np.stack([chain.base for chain in chains]),
            lengths=np.stack([chain.lengths for chain in chains]),
            mirror=np.array([chain.mirror for chain in chains]),
            rigid=rigid,
        )

    @property
    def model_of(self) -> Index:
        """The model of each marker (M,)."""
        return np.repeat(np.arange(len(self.rigid)), np.diff(self.first))


@compiled(nogil=True)
def chain_of(scene: Scene, g: int) -> Chain:
    """Return the chain of model g."""
    return Chain(scene.base[g], scene.lengths[g], scene.mirror[g])


@compiled(nogil=True)
def place_markers(scene: Scene, g: int, pose: Array, bodies: BodyPoses, out: Array) -> None:
    """Write the markers s(theta) of model g in a pose (27,) to `out` (M, 3), metres.

    bodies: receive the transforms.
    """
    forward_kinematics(chain_of(scene, g), pose, bodies)
    for i in range(scene.first[g], scene.first[g + 1]):
        T, x = bodies.T[scene.body[i]], scene.local[i]
        for r in range(3):
            out[i, r] = T[r, 0] * x[0] + T[r, 1] * x[1] + T[r, 2] * x[2] + T[r, 3]

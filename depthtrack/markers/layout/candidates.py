"""Feasible places of markers: the vertices V' of Schroeder et al. 2015, Sec. 4.2 and 5."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from depthtrack.errors import InputError
from depthtrack.hand.compiled_kinematics import BODY_COUNT
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.implicit import rest_pose
from depthtrack.hand.skin.mesh import Skin
from depthtrack.markers.layout.options import FeasibleOptions
from depthtrack.markers.models.layout import Layout
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.markers.models.skin_marker import SkinMarker, marker_place
from depthtrack.types import Array, Index

SPREAD = 0.002
"""Standard deviation of a marker that a person sticks on by an instruction, metres, each axis."""


@dataclass(frozen=True, eq=False)
class Candidates:
    """V places where a marker may be.

    bodies: (V,) body that each place is fixed to.
    offsets: (V, 3) centre of a marker there, metres, frame of its body.
    rest: (V, 3) the same in the rest pose, palm frame.
    places: (V,) bone, share along it and angle about it; empty for the markers of a model.
    radius: of the markers, metres.
    """

    hand: HandShape
    bodies: Index
    offsets: Array
    rest: Array
    places: tuple[tuple[str, float, float], ...]
    radius: float

    @staticmethod
    def on_skin(hand: HandShape, options: FeasibleOptions | None = None) -> "Candidates":
        """Return the vertices of the skin that face the back of their bone and move with it alone.

        The back of a finger's bone is the side of its nail, that of the palm the back of the hand. In a flat hand this
        is the back-facing vector of the paper. The thumb has its own.

        Raises:
            InputError: if the skin has fewer than two such vertices.
        """
        return _on_skin(hand, options or FeasibleOptions())

    @staticmethod
    def of_model(model: MarkerModel) -> "Candidates":
        """Return the markers of a hand as candidates.

        Raises:
            InputError: if the model is a rigid body.
        """
        if model.hand is None:
            raise InputError(f"a layout is chosen from the markers of a hand, found the rigid body '{model.name}'")
        rest = model.positions(rest_pose(model.hand))
        return Candidates(model.hand, np.asarray(model.bodies), np.asarray(model.offsets), rest, (), 0.0)

    def __len__(self) -> int:
        return len(self.bodies)

    def by_body(self) -> tuple[Index, ...]:
        """Return the candidates of each body that has some."""
        groups = (np.flatnonzero(self.bodies == body) for body in range(BODY_COUNT))
        return tuple(group for group in groups if len(group))

    def random_rows(self, shape: int | tuple[int, ...], generator: np.random.Generator) -> Index:
        """Return random candidates; each bone is as likely as another."""
        groups = self.by_body()
        group, share = generator.integers(len(groups), size=shape), generator.random(shape)
        sizes = np.array([len(rows) for rows in groups])
        first = np.cumsum(sizes) - sizes
        return np.asarray(np.concatenate(groups)[first[group] + (share * sizes[group]).astype(np.int64)])

    def layout(self, chosen: Sequence[int] | Index, about: str, anchored: bool = False) -> Layout:
        """Return the layout of chosen candidates of a skin, from thumb to little finger and outward.

        anchored: add the marker at the wrist.
        """
        order = sorted(map(int, chosen), key=lambda v: (self.bodies[v] == 0, self.bodies[v], self.places[v]))
        markers, used = [], dict[str, int]()
        for v in order:
            bone, along, around = self.places[v]
            used[bone] = used.get(bone, 0) + 1
            label = bone if used[bone] == 1 else f"{bone}_{used[bone]}"
            markers.append(SkinMarker(label, bone, along, around, SPREAD))
        if anchored:
            markers.append(SkinMarker("wrist", "middle_metacarpal", 0.0, 0.0, SPREAD))
        return Layout(about, self.radius, tuple(markers))


@lru_cache(maxsize=4)
def _on_skin(hand: HandShape, options: FeasibleOptions) -> Candidates:
    skin = Skin.of(hand)
    bodies = skin.weights.argmax(axis=1)
    T_body_palm = skin.T_body_rest[bodies]
    normals = np.einsum("nij,nj->ni", T_body_palm[:, :3, :3], skin.normals(skin.rest))
    rigid = skin.weights.max(axis=1) >= options.rigid - 1e-12
    rows = np.flatnonzero(rigid & (-normals[:, 2] > options.back_facing))
    on_skin = np.einsum("nij,nj->ni", T_body_palm[rows, :3, :3], skin.rest[rows]) + T_body_palm[rows, :3, 3]
    right = on_skin * [hand.mirror, 1, 1] / hand.scale
    shape = hand.with_(side="right", scale=1.0, rig=None)
    placed = [marker_place(shape, int(body), point) for body, point in zip(bodies[rows], right, strict=True)]
    kept = np.array([place is not None for place in placed], dtype=np.bool_)
    if kept.sum() < 2:
        raise InputError("the skin has fewer than two places for markers: lower back_facing or rigid")
    offsets = on_skin + options.radius * normals[rows]
    rest = HandModel(hand).transform_points(rest_pose(hand), bodies[rows], offsets)
    return Candidates(
        hand=hand,
        bodies=bodies[rows][kept].astype(np.int64),
        offsets=offsets[kept],
        rest=rest[kept],
        places=tuple(place for place in placed if place is not None),
        radius=options.radius,
    )

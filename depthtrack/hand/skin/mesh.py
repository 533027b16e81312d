"""The skinned triangle mesh of the hand, built from its sizes or read from a user's rig.

Source: Schroeder et al. 2014, Sec. III.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from depthtrack.errors import InputError
from depthtrack.geometry.isosurface import neighbour_average, polygonise
from depthtrack.hand.compiled_kinematics import BODY_COUNT, Chain
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.reference_kinematics import reference_transforms
from depthtrack.hand.rig.rig_import import RiggedHand, reread_rigged_hand
from depthtrack.hand.shape import SIZE_NAMES, HandShape
from depthtrack.hand.skin.displacement import displacement_basis
from depthtrack.hand.skin.implicit import ImplicitHand, rest_pose
from depthtrack.hand.skin.weights import skin_weights
from depthtrack.types import Array, Faces, Index

if TYPE_CHECKING:
    from trimesh import Trimesh

_VERTICES = 7000
"""Approximate number of vertices of a built hand of usual proportions."""
_SAME_SIZE = 1e-6
"""Largest difference, metres, between sizes in a hand file and the same ones measured again."""


@dataclass(frozen=True, eq=False)
class Skin:
    """A triangle mesh moved by the 16 bodies of `HandModel(shape)`, by linear blend skinning.

    `rest` (V, 3): vertices at rest, palm frame, metres.
    `faces` (F, 3): counter-clockwise from outside.
    `weights` (V, 16): of the bodies; each row is convex.
    `T_body_rest` (16, 4, 4): from the palm frame at rest to each body's frame.
    """

    shape: HandShape
    rest: Array
    faces: Faces
    weights: Array
    T_body_rest: Array

    def __post_init__(self) -> None:
        for array in (self.rest, self.faces, self.weights, self.T_body_rest):
            array.flags.writeable = False

    @classmethod
    def of(cls, shape: HandShape) -> "Skin":
        """Return the skin of a hand: its rigged mesh if it has one, else built from its sizes.

        A built skin is closed. It takes under a second and is cached by shape.

        Raises:
            InputError: if the sizes give no solid without holes, such as fingers grown together; or if the rig's file
                is missing or changed, or is of other sizes.
        """
        return _skin_of(shape.with_(source=""))

    def vertices(self, transforms: ArrayLike) -> Array:
        """Return posed vertices by linear blend skinning (Schroeder et al. 2014, Eq. 2).

        `transforms` (..., 16, 4, 4): T_camera_body, as `HandModel.transforms` returns them.
        Returns (..., V, 3): camera frame, metres.
        """
        moved = (np.asarray(transforms, dtype=np.float64) @ self.T_body_rest)[..., :3, :]
        batch = moved.shape[:-3]
        by_body = np.moveaxis(moved, -3, 0).reshape(BODY_COUNT, -1)
        blended = (self._sparse_weights @ by_body).reshape(-1, *batch, 3, 4)
        rest = self.rest.reshape(-1, *(1,) * len(batch), 1, 3)
        return np.moveaxis(np.sum(blended[..., :3] * rest, axis=-1) + blended[..., 3], 0, -2)

    def at(self, pose: ArrayLike) -> Array:
        """Return the camera-frame vertices (..., V, 3), metres, of poses (..., 27)."""
        return self.vertices(HandModel(self.shape).transforms(pose))

    def normals(self, vertices: Array) -> Array:
        """Return outward unit normals (..., V, 3) of vertices (..., V, 3), area-weighted face means."""
        a, b, c = (vertices[..., self.faces[:, k], :] for k in range(3))
        of_faces = np.cross(b - a, c - a)
        flat = np.moveaxis(of_faces, -2, 0).reshape(len(self.faces), -1)
        total = np.moveaxis((self._faces_around @ flat).reshape(-1, *of_faces.shape[:-2], 3), 0, -2)
        return np.asarray(total / np.maximum(np.linalg.norm(total, axis=-1, keepdims=True), 1e-30))

    def to_trimesh(self, vertices: Array) -> "Trimesh":
        """Return the trimesh of posed vertices (V, 3), for queries and export."""
        from trimesh import Trimesh

        return Trimesh(vertices, self.faces, process=False)

    @cached_property
    def face_bodies(self) -> Index:
        """The body (F,) with the largest weight of each face."""
        return np.asarray(self.weights[self.faces].sum(axis=1).argmax(axis=-1), dtype=np.int64)

    @cached_property
    def displacement_basis(self) -> tuple[csr_array, Array]:
        """The displacements (V, NODES) of vertices by those of nodes, and normals (V, 3) at rest.

        The displacements are those of scale 1.
        """
        shape, mirror = self.shape, np.diag([self.shape.mirror, 1, 1, 1])
        T_body_rest = mirror @ self.T_body_rest @ mirror
        T_body_rest[:, :3, 3] /= shape.scale
        right = self.rest @ mirror[:3, :3] / shape.scale
        basis = displacement_basis(shape.with_(scale=1.0, side="right"), right, self.weights, T_body_rest)
        return basis, self.normals(self.rest)

    @cached_property
    def _sparse_weights(self) -> csr_array:
        return csr_array(self.weights)

    @cached_property
    def _faces_around(self) -> csr_array:
        """Incidence (V, F) of vertices and faces."""
        columns = np.repeat(np.arange(len(self.faces)), 3)
        ones = np.ones(len(columns))
        return csr_array((ones, (self.faces.ravel(), columns)), shape=(len(self.rest), len(self.faces)))


@lru_cache(maxsize=8)
def _skin_of(shape: HandShape) -> Skin:
    if shape.rig is not None:
        return _rigged(shape, reread_rigged_hand(shape.rig))
    if shape.displacement is None:
        return _built(shape)
    return _displaced(_skin_of(shape.with_(displacement=None)), shape, shape.displacement)


def _displaced(skin: Skin, shape: HandShape, displacement: Array) -> Skin:
    """Return a skin whose vertices are moved along their normals."""
    basis, normals = skin.displacement_basis
    along = shape.scale * (basis @ displacement)
    return replace(skin, shape=shape, rest=skin.rest + along[:, None] * normals)


def _rigged(shape: HandShape, rigged: RiggedHand) -> Skin:
    """Return the rig's mesh at the scale and on the side of `shape`.

    Raises:
        InputError: if the sizes of `shape` are not the ones measured on the rig.
    """
    measured = rigged.shape.with_(scale=shape.scale, side=shape.side, source=shape.source, rig=shape.rig)
    pairs = ((getattr(shape, name), getattr(measured, name)) for name in SIZE_NAMES)
    if not all(np.allclose(ours, theirs, rtol=0, atol=_SAME_SIZE) for ours, theirs in pairs):
        raise InputError(
            f"the hand's sizes must be those measured on its rig {rigged.shape.rig and rigged.shape.rig.path}, only "
            "scale and side may differ: remove the entry `rig` to build a skin from these sizes"
        )
    mirror = np.diag([rigged.shape.mirror * shape.mirror, 1, 1, 1])
    T_body_rest = mirror @ rigged.T_body_rest @ mirror
    T_body_rest[:, :3, 3] *= shape.scale
    faces = rigged.faces if shape.side == rigged.shape.side else np.ascontiguousarray(rigged.faces[:, ::-1])
    return Skin(shape, rigged.rest @ mirror[:3, :3] * shape.scale, faces, rigged.weights, T_body_rest)


def _built(shape: HandShape) -> Skin:
    # The solid is a right hand of scale 1. A left hand is its mirror image, with reversed faces.
    vertices, faces, weights = _solid_mesh(shape.with_(scale=1.0, side="right"))
    rest = vertices * np.array([shape.mirror, 1, 1]) * shape.scale
    if shape.side == "left":
        faces = np.ascontiguousarray(faces[:, ::-1])
    T_palm_body = reference_transforms(Chain.of(shape), rest_pose(shape))
    return Skin(shape, rest, faces, weights, np.asarray(np.linalg.inv(T_palm_body), dtype=np.float64))


@lru_cache(maxsize=4)
def _solid_mesh(shape: HandShape) -> tuple[Array, Faces, Array]:
    """Return vertices (V, 3), faces (F, 3) and weights (V, 16) of a right hand of scale 1."""
    solid = ImplicitHand.of(shape)
    low, high = solid.bounds()
    vertices, faces = polygonise(solid.distance, low, high, _cell(shape, high - low))
    _check_closed(vertices, faces)
    return vertices, faces, skin_weights(solid, vertices, faces)


def _cell(shape: HandShape, box: Array) -> float:
    """Return the grid spacing, metres: about `_VERTICES` vertices, finer for thin fingers."""
    area = 2 * shape.palm_length * shape.palm_breadth + 2 * np.pi * float(np.sum(shape.lengths * shape.radii[:, 1:]))
    wanted = min(np.sqrt(1.4 * area / _VERTICES), 0.65 * shape.radii.min())
    return max(float(wanted), float(np.cbrt(np.prod(box) / 4e5)))


def _check_closed(vertices: Array, faces: Faces) -> None:
    # Every edge of a surface net has two faces, so Euler's formula for one sphere reads V - F / 2 = 2.
    pieces = connected_components(neighbour_average(faces, len(vertices)), directed=False)[0] if len(faces) else 0
    if pieces != 1 or len(vertices) - len(faces) // 2 != 2:
        raise InputError(
            "the hand sizes must give one solid hand with five free fingers, found separate parts or fingers "
            "that grow together: bring radii and base positions closer to the default hand's proportions"
        )

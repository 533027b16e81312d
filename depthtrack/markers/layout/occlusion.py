"""Occlusion of markers by the hand, for cameras placed around the volume."""

from collections.abc import Sequence

import numpy as np

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rotations import quaternion_from_matrix
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.hand.skin.mesh import Skin
from depthtrack.markers.layout.candidates import Candidates
from depthtrack.rendering.triangles import rasterise
from depthtrack.types import Array

_DISTANCE = 1.5
"""Distance of a camera from the hand, metres."""
_PIXELS, _SPAN = 128, 0.26
"""Side of the rendered image, pixels and metres at the hand."""
_BEHIND = 0.004
"""Depth behind the skin from which a marker is hidden, metres."""
_NEEDED = 2
"""Cameras that must see a marker."""
_TURNS = tuple(np.radians((0.0, 60.0, 120.0, 180.0, 240.0, 300.0)).tolist())
"""Turns of the hand about the vertical."""


def camera_directions(count: int) -> Array:
    """Return unit directions (count, 3) from the hand to cameras in a ring above it.

    They are 35 degrees up; y is up. Raises InputError if the number is not 2 to 64.
    """
    if not _NEEDED <= count <= 64:
        raise InputError(f"cameras around the volume must be {_NEEDED} to 64, found {count}")
    azimuth, up = np.arange(count) * 2 * np.pi / count, np.radians(35.0)
    return np.stack([np.cos(azimuth) * np.cos(up), np.full(count, np.sin(up)), np.sin(azimuth) * np.cos(up)], axis=1)


def hidden_shares(candidates: Candidates, postures: Array, directions: Array, turns: Sequence[float] = _TURNS) -> Array:
    """Return the share (V,) of samples in which fewer than two cameras see each candidate.

    postures: (F, 20) rad. The samples are those in all turns of the hand about the vertical, rad.
    directions: (C, 3) unit, from the hand to the cameras, y up. The palm faces down.
    """
    hand = candidates.hand
    model, skin = HandModel(hand), Skin.of(hand)
    focal = _PIXELS * _DISTANCE / (_SPAN * hand.scale)
    camera = Camera(_PIXELS, _PIXELS, focal, focal, _PIXELS / 2, _PIXELS / 2)
    # Palm axes x, y (fingers) and z (out of the palm) in the volume: the palm faces down.
    R_volume_palm = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
    seen = np.zeros((len(postures), len(turns), len(candidates)), dtype=np.int64)
    for t, turn in enumerate(turns):
        c, s = np.cos(turn), np.sin(turn)
        R = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ R_volume_palm
        for direction in directions:
            quaternion = quaternion_from_matrix(_facing(direction) @ R)
            for f, posture in enumerate(postures):
                pose = make_pose([0, 0, _DISTANCE], quaternion, posture)
                vertices = skin.at(pose)
                surface = rasterise(camera, vertices, skin.faces, skin.normals(vertices), skin.face_bodies)
                points = model.transform_points(pose, candidates.bodies, candidates.offsets)
                pixels = np.rint(camera.project(points)).astype(int)
                inside = np.all((pixels >= 0) & (pixels < _PIXELS), axis=1)
                x, y = np.clip(pixels, 0, _PIXELS - 1).T
                depth = surface.depth[y, x]
                seen[f, t] += ~inside | (depth == 0) | (points[:, 2] < depth + _BEHIND)
    return np.asarray(np.mean(seen < _NEEDED, axis=(0, 1)))


def _facing(direction: Array) -> Array:
    """Return R_camera_volume (3, 3) of a camera that is seen in a direction (3,), image y down."""
    z = -direction
    x = np.cross([0.0, -1.0, 0.0], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])

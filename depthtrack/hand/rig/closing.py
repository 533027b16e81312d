"""Close the holes of a mesh, such as the open wrist of a hand that was cut from a body."""

from dataclasses import replace

import numpy as np

from depthtrack.hand.rig.gltf import Rig
from depthtrack.types import Faces, Index


def close_holes(rig: Rig) -> Rig:
    """Fill each boundary loop with a fan around its centroid, with the loop's mean weights."""
    loops = boundary_loops(rig.faces)
    if not loops:
        return rig
    vertices, faces, joints = [rig.vertices], [rig.faces], len(rig.names)
    dense = []
    for centre, loop in enumerate(loops, len(rig.vertices)):
        vertices.append(rig.vertices[loop].mean(axis=0, keepdims=True))
        faces.append(np.stack([np.roll(loop, -1), loop, np.full(len(loop), centre)], axis=-1))
        dense.append(np.bincount(rig.bound[loop].ravel(), rig.weights[loop].ravel(), joints) / len(loop))
    influences = rig.bound.shape[1]
    strongest = np.argsort(-np.array(dense), axis=1, kind="stable")[:, :influences]
    share = np.take_along_axis(np.array(dense), strongest, axis=1)
    short = ((0, 0), (0, influences - strongest.shape[1]))  # of a rig with fewer joints than influences
    strongest, share = np.pad(strongest, short), np.pad(share, short)
    return replace(
        rig,
        vertices=np.concatenate(vertices),
        faces=np.concatenate(faces),
        bound=np.concatenate([rig.bound, strongest]),
        weights=np.concatenate([rig.weights, share / share.sum(axis=1, keepdims=True)]),
    )


def boundary_loops(faces: Faces) -> list[Index]:
    """Return the closed loops of boundary edges, vertex by vertex in the faces' direction.

    Boundaries that meet in one vertex are left out, since they are not simple loops.
    """
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    count = int(faces.max(initial=0)) + 1
    keys, opposite = edges[:, 0] * count + edges[:, 1], edges[:, 1] * count + edges[:, 0]
    open_edges = edges[~np.isin(keys, opposite)]
    starts, uses = np.unique(open_edges[:, 0], return_counts=True)
    simple = set(starts[uses == 1].tolist())
    following = {a: b for a, b in open_edges.tolist() if a in simple}
    loops = []
    while following:
        first = next(iter(following))
        loop, vertex = [first], following.pop(first)
        while vertex != first and vertex in following:
            loop.append(vertex)
            vertex = following.pop(vertex)
        if vertex == first and len(loop) >= 3:
            loops.append(np.array(loop, dtype=np.int64))
    return loops

"""Euclidean clustering (Maycock et al. 2015, Sec. III-A, *Automatic Clustering*)."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from depthtrack.types import Array, Index


def euclidean_clusters(points: Array, distance: float) -> list[Index]:
    """Return the indices of the points of each cluster, the largest first.

    points: (K, 3) metres.
    distance: points nearer to each other than this are of one cluster, metres.

    Source: the Euclidean cluster extraction of Rusu and Cousins, "3D is here: Point Cloud Library", ICRA 2011.
    """
    pairs = cKDTree(points).query_pairs(distance, output_type="ndarray")
    edges = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))
    count, label = connected_components(edges, directed=False)
    clusters = [np.flatnonzero(label == c).astype(np.int64) for c in range(count)]
    return sorted(clusters, key=len, reverse=True)

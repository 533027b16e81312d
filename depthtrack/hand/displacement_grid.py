"""Nodes of the displacement of a person's skin, and their entries in hand files."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from depthtrack.hand.pose import FINGERS
from depthtrack.types import Array

ALONG, AROUND = 7, 8
"""Nodes along a finger, at its joints, at its tip and halfway between, and around it."""
PALM_ALONG, PALM_AROUND = 5, 12
"""Nodes along the palm, from the wrist to the knuckles, and around it."""
PALM_FIRST = len(FINGERS) * ALONG * AROUND
"""First node of the palm, behind those of the fingers."""
NODES = PALM_FIRST + PALM_ALONG * PALM_AROUND
_PARTS = {name: (f * ALONG * AROUND, ALONG, AROUND) for f, name in enumerate(FINGERS)} | {
    "palm": (PALM_FIRST, PALM_ALONG, PALM_AROUND)
}


def displacement_fields(displacement: Array) -> dict[str, Any]:
    """Return displacements (NODES,), m, as entries of a hand file, in mm."""
    mm = np.round(1000 * displacement, 4)
    return {
        name: mm[first : first + along * around].reshape(along, around).tolist()
        for name, (first, along, around) in _PARTS.items()
    }


def displacement_of(fields: Mapping[str, Any]) -> Array:
    """Return the displacements (NODES,), m, of entries of a hand file.

    Raises:
        KeyError, TypeError, ValueError: if an entry is missing or malformed.
    """
    found = np.zeros(NODES)
    for name, (first, along, around) in _PARTS.items():
        rows = np.array(fields[name], dtype=np.float64)
        if rows.shape != (along, around):
            raise ValueError(f"the displacement of {name} must have {along} rows of {around}, found {rows.shape}")
        found[first : first + along * around] = rows.ravel() / 1000
    return found


def neighbour_differences() -> csr_array:
    """Return the differences (D, NODES) of neighbouring nodes, along and around the parts."""
    pairs = list[Array]()
    for first, along, around in _PARTS.values():
        node = first + np.arange(along * around).reshape(along, around)
        pairs += [np.stack([node, np.roll(node, -1, axis=1)], axis=-1), np.stack([node[:-1], node[1:]], axis=-1)]
    table = np.concatenate([each.reshape(-1, 2) for each in pairs])
    row = np.repeat(np.arange(len(table)), 2)
    return csr_array((np.tile([-1.0, 1.0], len(table)), (row, table.ravel())), shape=(len(table), NODES))

"""Reading of a hand: sizes from a hand file, or measured on a user's rigged mesh."""

from pathlib import Path

from depthtrack.errors import InputError
from depthtrack.hand.rig.rig_import import read_rigged_hand
from depthtrack.hand.shape import HandShape, Side

RIG_SUFFIXES = (".glb", ".gltf")


def load_hand(path: Path, side: Side | None = None) -> HandShape:
    """Return the hand of a hand file (hand.json) or of a rigged mesh (.glb, .gltf).

    A hand of a rigged mesh refers to it (`HandShape.rig`): surface fits and pictures then use that mesh.

    side: the hand to read from a rig with both, or the side that the file must have; any if None.

    Raises:
        InputError: if the file is missing or damaged, holds no hand, or holds the other side's.
        MissingExtraError: if the file is a rig and pygltflib is not installed.
    """
    if is_rig(path):
        return read_rigged_hand(path, side).shape
    shape = HandShape.from_json(path)
    if side not in (None, shape.side):
        raise InputError(f"{path} holds a {shape.side} hand, but a {side} one was asked for: leave the side out")
    return shape


def is_rig(path: Path) -> bool:
    """Return whether a path names a rigged mesh."""
    return path.suffix.lower() in RIG_SUFFIXES

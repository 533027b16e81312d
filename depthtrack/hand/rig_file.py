"""Reference from a hand's sizes to the rigged mesh that they were measured on."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, Self, cast, get_args

from depthtrack.errors import InputError

Side = Literal["right", "left"]

MAX_PATH = 1024
"""Largest number of characters in the path of a rig."""
UNITS = (1e-4, 1e2)
"""Smallest and largest unit of length of a rig, metres."""


@dataclass(frozen=True)
class RigFile:
    """A rigged hand in a glTF file, identified by the digest of its content.

    `path`: the .glb or .gltf file.
    `sha256`: digest of the file, its external buffers and its joint mapping, 64 hexadecimal digits.
    `side`: the hand that is read from the file.
    `unit`: metres per unit of length of the file.
    """

    path: Path
    sha256: str
    side: Side
    unit: float = 1.0

    def to_fields(self) -> dict[str, Any]:
        """Return the JSON entry `rig` of a hand file."""
        return {"path": str(self.path), "sha256": self.sha256, "side": self.side, "unit": self.unit}

    @classmethod
    def from_fields(cls, fields: Mapping[str, Any]) -> Self:
        """Read the JSON entry `rig` of a hand file.

        Raises:
            InputError: if a value is out of range.
            KeyError, TypeError, ValueError: if an entry is missing or of another type.
        """
        path, digest, side, unit = fields["path"], fields["sha256"], fields["side"], float(fields.get("unit", 1.0))
        if not isinstance(path, str) or not 0 < len(path) <= MAX_PATH or "\0" in path:
            raise InputError(f"the rig's path must be 1 to {MAX_PATH} characters, found {str(path)[:80]!r}")
        if not isinstance(digest, str) or not re.fullmatch("[0-9a-f]{64}", digest):
            raise InputError(f"the rig's sha256 must be 64 hexadecimal digits, found {str(digest)[:80]!r}")
        if side not in get_args(Side):
            raise InputError(f"the rig's side must be 'right' or 'left', found {str(side)[:80]!r}")
        if not UNITS[0] <= unit <= UNITS[1]:
            raise InputError(f"the rig's unit must be {UNITS[0]:g} to {UNITS[1]:g} m, found {unit:g}")
        return cls(Path(path), digest, cast(Side, side), unit)

    def beside(self, folder: Path) -> Self:
        """Return the same reference, its path relative to `folder` unless it is absolute."""
        return replace(self, path=folder / self.path)

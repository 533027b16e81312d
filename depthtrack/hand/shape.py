"""Sizes of one person's hand, and their JSON file.

Palm frame of both hands: origin at the palm's centre, y towards the fingers, z out of the palm (palmar), x to the right
if the palm faces the viewer. So x points towards the thumb of a right hand and away from that of a left hand.
All sizes are stored for a right hand; a left hand is its mirror image in x.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self, cast, get_args

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import compact_json, read_json
from depthtrack.hand.displacement_grid import NODES, displacement_fields, displacement_of
from depthtrack.hand.pose import FINGERS
from depthtrack.hand.rig_file import RigFile
from depthtrack.hand.rig_file import Side as Side
from depthtrack.strict_data import exact_json_text
from depthtrack.types import Array

# Phalanx lengths and soft tissue at the tips: Buryanov and Kotiuk, "Proportions of hand segments", Int. J. Morphol.
# 28(3), 2010 (means of 66 adults); the last length reaches the skin of the fingertip: distal phalanx + soft tissue.
_LENGTHS_MM = {
    "thumb": (46.2, 31.6, 27.3),
    "index": (39.8, 22.4, 19.7),
    "middle": (44.6, 26.3, 21.4),
    "ring": (41.4, 25.7, 21.3),
    "little": (32.7, 18.1, 19.7),
}
# Half the mean of joint breadth and depth, men and women averaged and rounded to half a millimetre, after Greiner,
# "Hand Anthropometry of U.S. Army Personnel", Natick TR-92/011, 1991, and Garrett, "The adult human hand", Human
# Factors 13, 1971: at the base joint, the two joints beyond it, and the fingertip's pad.
_RADII_MM = {
    "thumb": (15.0, 11.5, 10.0, 8.0),
    "index": (11.0, 9.5, 8.0, 6.5),
    "middle": (11.0, 9.5, 8.0, 6.5),
    "ring": (10.5, 9.0, 7.5, 6.0),
    "little": (9.5, 8.0, 6.5, 5.5),
}
# Knuckles and the thumb's saddle joint in the palm frame: metacarpal lengths of Buryanov and Kotiuk on a carpus
# 27 mm high (Youm et al., "Kinematics of the wrist", 1978), spread over the hand breadth of Greiner (85 mm).
_BASES_MM = {
    "thumb": (20.0, -32.0, 6.0),
    "index": (24.5, 43.0, 0.0),
    "middle": (3.0, 46.0, 0.0),
    "ring": (-16.5, 41.5, 0.0),
    "little": (-33.5, 33.0, 0.0),
}
_SOURCE = "depthtrack default: Buryanov and Kotiuk 2010; Greiner 1991; Garrett 1971; Youm et al. 1978"


CALIBRATED = 0.004
"""Metres: uncertainty of calibrated hands. Source: see `tools/fit_confidence.py`."""


@dataclass(frozen=True)
class HandShape:
    """Sizes of one hand, and the file of its surface if that is a user's rigged mesh.

    Lengths are metres here and millimetres in the JSON file. `scale` multiplies them all. Arrays are read-only and
    hold the right hand, unscaled, in the palm frame.

    lengths: (5, 3) phalanges from the palm outward.
    radii: (5, 4) half the thickness at the base, at two joints and at the tip.
    bases: (5, 3) base joints.
    thumb_direction, thumb_pad: (3,) directions of the resting thumb and of its pad.
    rig: the mesh that the sizes were measured on; None if the surface is built from the sizes (`Skin.of`).
    displacement: (NODES,) of the skin along its normals, see `skin.displacement`; None for none.
    uncertainty: standard deviation of a point of the person's hand from that of this one in the same pose, metres. By
        default it is that of a calibrated hand; 0 for the true one.

    Raises:
        InputError: if a size, the scale or the side is out of range.
    """

    side: Side = "right"
    scale: float = 1.0
    lengths: Array = field(default_factory=lambda: _table(_LENGTHS_MM))
    radii: Array = field(default_factory=lambda: _table(_RADII_MM))
    bases: Array = field(default_factory=lambda: _table(_BASES_MM))
    thumb_direction: Array = field(default_factory=lambda: _frozen([0.58, 0.73, 0.36]))
    thumb_pad: Array = field(default_factory=lambda: _frozen([-0.75, 0.20, 0.60]))
    palm_breadth: float = 0.079
    palm_length: float = 0.092
    palm_thickness: float = 0.029
    wrist_breadth: float = 0.057
    wrist_thickness: float = 0.039
    source: str = _SOURCE
    rig: RigFile | None = None
    displacement: Array | None = None
    uncertainty: float = CALIBRATED

    def __post_init__(self) -> None:
        if self.side not in get_args(Side):
            raise InputError(f"hand side must be 'right' or 'left', found {self.side!r}")
        if not 0.2 <= self.scale <= 5:
            raise InputError(f"hand scale must lie between 0.2 and 5, found {self.scale!r}")
        for name, shape in _ARRAY_SHAPES.items():
            array = _frozen(getattr(self, name))
            object.__setattr__(self, name, array)
            if array.shape != shape or not np.all(np.isfinite(array)):
                raise InputError(f"hand {name} must be {shape} finite numbers, found shape {array.shape}")
        if self.displacement is not None:
            self._check_displacement(_frozen(self.displacement))
        if not 0 <= self.uncertainty <= 0.1:
            raise InputError(f"hand uncertainty must lie between 0 and 100 mm, found {1000 * self.uncertainty!r}")
        sizes = np.concatenate([self.lengths.ravel(), self.radii.ravel(), [getattr(self, n) for n in _PALM_SIZES]])
        if sizes.min() < 1e-4 or sizes.max() > 0.5 or np.abs(self.bases).max() > 0.5:
            raise InputError("hand sizes must lie between 0.1 and 500 mm; is the file in millimetres?")

    def _check_displacement(self, displacement: Array) -> None:
        object.__setattr__(self, "displacement", displacement)
        if self.rig is not None:
            raise InputError("a hand with a rig takes its surface from there: remove the entry `skin_displacement_mm`")
        if displacement.shape != (NODES,) or not np.all(np.abs(displacement) <= 0.02):
            raise InputError(f"the skin's displacement must be {NODES} numbers within 20 mm")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, HandShape) and self._text == other._text

    def __hash__(self) -> int:
        return hash(self._text)

    @property
    def mirror(self) -> float:
        """+1 for a right hand, -1 for a left one: the factor on palm-frame x."""
        return 1.0 if self.side == "right" else -1.0

    @property
    def wrist(self) -> Array:
        """The wrist joint (3,), metres, palm frame, scaled."""
        return np.array([0.0, -self.palm_length / 2 * self.scale, 0.0])

    @property
    def reach(self) -> float:
        """Largest distance from the palm's centre to a fingertip, metres."""
        fingers = np.linalg.norm(self.bases, axis=1) + self.lengths.sum(axis=1)
        return float(fingers.max() * self.scale)

    def with_(self, **changes: Any) -> Self:
        """Return a copy with some fields replaced and all checked again.

        Raises:
            InputError: if a size is out of range.
        """
        return replace(self, **changes)

    def to_json(self) -> str:
        """Return the text of `hand.json`, sizes in millimetres."""
        return compact_json(self.to_fields())

    @cached_property
    def _text(self) -> str:
        """The contents of `hand.json` in one line: hands with equal ones are equal."""
        return exact_json_text(self.to_fields())

    def to_fields(self) -> dict[str, Any]:
        """Return the contents of `hand.json`, sizes in millimetres."""
        return {
            "side": self.side,
            "scale": float(self.scale),
            "palm": {f"{name}_mm": _mm(getattr(self, name)) for name in _PALM_SIZES},
            "thumb_at_rest": {"direction": self.thumb_direction.tolist(), "pad": self.thumb_pad.tolist()},
            "fingers": {
                finger: {
                    "base_mm": _mm(self.bases[f]),
                    "lengths_mm": _mm(self.lengths[f]),
                    "radii_mm": _mm(self.radii[f]),
                }
                for f, finger in enumerate(FINGERS)
            },
            **({} if self.displacement is None else {"skin_displacement_mm": displacement_fields(self.displacement)}),
            "source": self.source,
            **({} if self.uncertainty == CALIBRATED else {"uncertainty_mm": _mm(self.uncertainty)}),
            **({} if self.rig is None else {"rig": self.rig.to_fields()}),
        }

    @classmethod
    def from_json(cls, path: Path) -> Self:
        """Return the hand of a `hand.json`; the path of its rig is relative to the file's folder.

        Raises:
            InputError: if the file is missing or malformed, or a size is missing or out of range.
        """
        shape = read_json(path, "the hand file", cls.from_fields, made_by="depthtrack synth")
        return shape if shape.rig is None else shape.with_(rig=shape.rig.beside(path.parent.resolve()))

    @classmethod
    def from_fields(cls, fields: dict[str, Any]) -> Self:
        """Return the hand of the parsed contents of a `hand.json`.

        Raises:
            KeyError, TypeError, ValueError: if an entry is missing or malformed.
            InputError: if a size is out of range.
        """
        fingers = [fields["fingers"][finger] for finger in FINGERS]
        return cls(
            side=cast(Side, fields["side"]),
            scale=float(fields.get("scale", 1.0)),
            bases=_frozen([f["base_mm"] for f in fingers]) / 1000,
            lengths=_frozen([f["lengths_mm"] for f in fingers]) / 1000,
            radii=_frozen([f["radii_mm"] for f in fingers]) / 1000,
            thumb_direction=_frozen(fields["thumb_at_rest"]["direction"]),
            thumb_pad=_frozen(fields["thumb_at_rest"]["pad"]),
            source=str(fields.get("source", "")),
            uncertainty=float(fields.get("uncertainty_mm", 1000 * CALIBRATED)) / 1000,
            displacement=(
                None if fields.get("skin_displacement_mm") is None else displacement_of(fields["skin_displacement_mm"])
            ),
            rig=None if fields.get("rig") is None else RigFile.from_fields(fields["rig"]),
            **{name: float(fields["palm"][f"{name}_mm"]) / 1000 for name in _PALM_SIZES},
        )


_ARRAY_SHAPES = {
    "lengths": (5, 3),
    "radii": (5, 4),
    "bases": (5, 3),
    "thumb_direction": (3,),
    "thumb_pad": (3,),
}
_PALM_SIZES = ("palm_breadth", "palm_length", "palm_thickness", "wrist_breadth", "wrist_thickness")
SIZE_NAMES = (*_ARRAY_SHAPES, *_PALM_SIZES)
"""Fields of `HandShape` that a rig determines: all except scale, side, source and rig."""


def _frozen(values: Any) -> Array:
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array


def _table(rows_mm: Mapping[str, tuple[float, ...]]) -> Array:
    return _frozen([np.array(rows_mm[finger]) / 1000 for finger in FINGERS])


def _mm(metres: Any) -> Any:
    """Return millimetres rounded to a nanometre, which a second round trip keeps."""
    return np.round(np.asarray(metres) * 1000, 6).tolist()


def other_side(side: Side) -> Side:
    """Return the side of the other hand."""
    return "left" if side == "right" else "right"

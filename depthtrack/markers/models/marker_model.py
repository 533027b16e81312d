"""A hand or a rigid body with markers, and its JSON file.

Both have a pose of 27 floats. A rigid body moves as the palm does; its finger angles stay zero.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.errors import InputError
from depthtrack.files import compact_json, read_json
from depthtrack.hand.compiled_kinematics import BODY_COUNT
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape, other_side
from depthtrack.hand.size_parameters import COUNT
from depthtrack.hand.synergies import Synergies
from depthtrack.types import Array, Index

MAX_MARKERS = 256
_FARTHEST = 2.0
"""Largest distance of a marker from the origin of its body, metres."""


@dataclass(frozen=True, eq=False)
class MarkerModel:
    """What carries M markers.

    name: of the model, such as "right"; its markers are labelled `name:label` where several models are present.
    labels: (M,) of the markers, all different.
    bodies: (M,) body that each marker is fixed to, see `hand.kinematics`; 0 throughout for a rigid body.
    offsets: (M, 3) metres, frame of the body.
    spread: (M,) metres, standard deviation of the offsets.
    hand: sizes of the hand; None for a rigid body.
    size_spread: (35,) standard deviation of these sizes, see `hand.size_parameters`; None if they are not measured.
    synergies: of the motions that the markers were chosen for; None if they are unknown.
    open_side: whether the capture decides the side of the hand. Files do not store it.

    Raises:
        InputError: if the fields do not agree, or a number is out of range.
    """

    name: str
    labels: tuple[str, ...]
    bodies: Index
    offsets: Array
    spread: Array
    hand: HandShape | None = None
    size_spread: Array | None = None
    synergies: Synergies | None = None
    open_side: bool = False

    def __post_init__(self) -> None:
        count = len(self.labels)
        bodies, offsets = np.array(self.bodies, dtype=np.int64), np.array(self.offsets, dtype=np.float64)
        spread = np.array(self.spread, dtype=np.float64)
        if not 1 <= count <= MAX_MARKERS:
            raise InputError(f"a model must have 1 to {MAX_MARKERS} markers, found {count}")
        if len(set(self.labels)) != count:
            raise InputError(f"the labels of the markers of '{self.name}' must differ")
        if bodies.shape != (count,) or offsets.shape != (count, 3) or spread.shape != (count,):
            raise InputError(f"the model '{self.name}' must have a body, an offset and a spread for each marker")
        largest = BODY_COUNT - 1 if self.hand is not None else 0
        if np.any((bodies < 0) | (bodies > largest)):
            raise InputError(f"markers of '{self.name}' must be on bodies 0 to {largest}, found {bodies.max()}")
        if not np.all(np.abs(offsets) <= _FARTHEST) or not np.all((spread >= 0) & (spread <= _FARTHEST)):
            raise InputError(f"offsets of markers must be below {_FARTHEST:g} m: is the file in millimetres?")
        if self.size_spread is not None:
            object.__setattr__(self, "size_spread", _checked_size_spread(self.size_spread))
        for name, array in (("bodies", bodies), ("offsets", offsets), ("spread", spread)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @property
    def is_rigid(self) -> bool:
        """Whether the model has no joints."""
        return self.hand is None

    @cached_property
    def kinematics(self) -> HandModel:
        """The kinematics that move the markers; those of any hand for a rigid body."""
        return HandModel(HandShape() if self.hand is None else self.hand)

    def positions(self, poses: ArrayLike) -> Array:
        """Return the markers (..., M, 3), metres, capture frame, of poses (..., 27).

        Source: Maycock et al. 2015, s(theta) in Eq. (4).
        """
        return self.kinematics.transform_points(poses, self.bodies, self.offsets)

    def with_(self, **changes: Any) -> Self:
        """Return a copy with some fields replaced and all checked again.

        Raises:
            InputError: as the constructor does.
        """
        return replace(self, **changes)

    def part(self, rows: Index) -> Self:
        """Return the model of some of its markers."""
        labels = tuple(self.labels[row] for row in rows)
        return self.with_(labels=labels, bodies=self.bodies[rows], offsets=self.offsets[rows], spread=self.spread[rows])

    def mirrored(self) -> Self:
        """Return the model of the hand's other side; a name that is the side changes with it."""
        assert self.hand is not None
        side = other_side(self.hand.side)
        return self.with_(
            name=side if self.name == self.hand.side else self.name,
            offsets=self.offsets * [-1, 1, 1],
            hand=self.hand.with_(side=side),
        )

    def to_json(self) -> str:
        """Return the text of the model's file, lengths in millimetres."""
        return compact_json(self.to_fields())

    def to_fields(self) -> dict[str, Any]:
        """Return the contents of the model's file, lengths in millimetres."""
        rows = zip(self.labels, self.bodies, self.offsets, self.spread, strict=True)
        return {
            "name": self.name,
            "markers": [
                {
                    "label": label,
                    "body": int(body),
                    "offset_mm": np.round(offset * 1000, 6).tolist(),
                    "spread_mm": round(float(spread) * 1000, 6),
                }
                for label, body, offset, spread in rows
            ],
            **({} if self.hand is None else {"hand": self.hand.to_fields()}),
            **({} if self.size_spread is None else {"size_spread": np.round(self.size_spread, 6).tolist()}),
            **({} if self.synergies is None else {"synergies": self.synergies.to_fields()}),
        }

    @classmethod
    def from_json(cls, path: Path) -> Self:
        """Return the model of a file.

        Raises:
            InputError: if the file is missing or malformed, or a number is out of range.
        """
        return read_json(path, "the marker model", cls.from_fields, made_by="depthtrack markers model")

    @classmethod
    def from_fields(cls, fields: dict[str, Any]) -> Self:
        """Return the model of the parsed contents of its file.

        Raises:
            KeyError, TypeError, ValueError: if an entry is missing or malformed.
            InputError: if a number is out of range.
        """
        rows = fields["markers"]
        return cls(
            name=str(fields["name"]),
            labels=tuple(str(row["label"]) for row in rows),
            bodies=np.array([int(row["body"]) for row in rows], dtype=np.int64),
            offsets=np.array([row["offset_mm"] for row in rows], dtype=np.float64).reshape(-1, 3) / 1000,
            spread=np.array([float(row.get("spread_mm", 0.0)) for row in rows]) / 1000,
            hand=None if fields.get("hand") is None else HandShape.from_fields(fields["hand"]),
            size_spread=None if fields.get("size_spread") is None else np.array(fields["size_spread"], np.float64),
            synergies=None if fields.get("synergies") is None else Synergies.from_fields(fields["synergies"]),
        )


def _checked_size_spread(values: Array) -> Array:
    array = np.array(values, dtype=np.float64)
    if array.shape != (COUNT,) or not np.all((array >= 0) & (array <= 1)):
        raise InputError(f"the spread of the sizes must be {COUNT} numbers from 0 to 1, found shape {array.shape}")
    array.flags.writeable = False
    return array

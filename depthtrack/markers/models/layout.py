"""Marker layouts on the skin of a hand of any size, and their JSON files.

The centre of a marker is on its ray (`skin_marker`), one marker radius away from the skin. The skin is the solid of
`hand.skin.implicit`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import compact_json, read_json
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.implicit import ImplicitHand
from depthtrack.hand.synergies import Synergies
from depthtrack.markers.models.marker_model import MAX_MARKERS, MarkerModel
from depthtrack.markers.models.skin_marker import SkinMarker, marker_ray
from depthtrack.resources import resource_folder
from depthtrack.types import Array

_FARTHEST = 0.06
"""Largest distance of a marker from its bone, metres, in a hand of scale 1."""
_STEP = 0.0005
"""Distance of the samples that bracket the skin, metres."""
_SECANTS = 4


@dataclass(frozen=True)
class Layout:
    """Markers on the skin of any hand.

    radius: of the markers, metres.
    synergies: of the motions that it was chosen for; None if they are unknown.
    """

    about: str
    radius: float
    markers: tuple[SkinMarker, ...]
    synergies: Synergies | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.radius <= 0.02:
            raise InputError(f"the radius of the markers must be at most 20 mm, found {self.radius * 1000:g} mm")
        if not 1 <= len(self.markers) <= MAX_MARKERS:
            raise InputError(f"a layout must have 1 to {MAX_MARKERS} markers, found {len(self.markers)}")

    def on(self, hand: HandShape, name: str | None = None) -> MarkerModel:
        """Return the model of a hand that wears the layout.

        name: of the model; None for the hand's side.

        Raises:
            InputError: if a marker finds no skin, because the hand's proportions are too unusual.
        """
        solid = ImplicitHand.of(hand)
        starts, directions = (
            np.array(rows) for rows in zip(*(marker_ray(solid, m) for m in self.markers), strict=True)
        )
        distance = _crossings(solid, starts, directions, self.radius / hand.scale)
        for marker in (m for m, found in zip(self.markers, distance, strict=True) if not np.isfinite(found)):
            raise InputError(f"marker '{marker.label}' finds no skin above {marker.along:g} of the {marker.bone}")
        bodies = np.array([marker.body for marker in self.markers])
        T_palm_body = solid.bones[bodies]
        lever = starts + distance[:, None] * directions - T_palm_body[:, :3, 3]
        local = np.einsum("nij,ni->nj", T_palm_body[:, :3, :3], lever)
        return MarkerModel(
            name=hand.side if name is None else name,
            labels=tuple(m.label for m in self.markers),
            bodies=bodies,
            offsets=local * [hand.mirror, 1, 1] * hand.scale,
            spread=np.array([m.spread for m in self.markers]),
            hand=hand,
            synergies=self.synergies,
        )

    def to_json(self) -> str:
        """Return the text of the layout's file, lengths in millimetres and angles in degrees."""
        rows = [
            {
                "label": marker.label,
                "bone": marker.bone,
                "along": round(marker.along, 4),
                "around_deg": round(float(np.degrees(marker.around)), 2),
                "spread_mm": round(1000 * marker.spread, 3),
            }
            for marker in self.markers
        ]
        spread = round(1000 * max(marker.spread for marker in self.markers), 3)
        radius = round(1000 * self.radius, 3)
        fields = {"about": self.about, "radius_mm": radius, "spread_mm": spread, "markers": rows}
        return compact_json(fields | ({} if self.synergies is None else {"synergies": self.synergies.to_fields()}))

    @classmethod
    def from_json(cls, path: Path) -> Self:
        """Return the layout of a file.

        Raises:
            InputError: if the file is missing or malformed, or a number is out of range.
        """
        return read_json(path, "the marker layout", cls.from_fields)

    @classmethod
    def from_fields(cls, fields: dict[str, Any]) -> Self:
        """Return the layout of the parsed contents of its file.

        Raises:
            KeyError, TypeError, ValueError: if an entry is missing or malformed.
            InputError: if a bone, a label or a layout is unknown, or a number is out of range.
        """
        about = str(fields.get("about", ""))
        if "like" in fields:
            return replace(cls.from_json(_included(str(fields["like"]))), about=about)._renamed(fields["labels"])
        spread = float(fields["spread_mm"])
        markers = tuple(
            SkinMarker(
                label=str(row["label"]),
                bone=str(row["bone"]),
                along=float(row["along"]),
                around=np.radians(float(row.get("around_deg", 0))),
                spread=float(row.get("spread_mm", spread)) / 1000,
            )
            for row in fields["markers"]
        )
        synergies = None if fields.get("synergies") is None else Synergies.from_fields(fields["synergies"])
        return cls(about, float(fields["radius_mm"]) / 1000, markers, synergies)

    def _renamed(self, labels: Mapping[str, str]) -> Self:
        """Return the layout of some markers with other labels: new label to label here."""
        known = {marker.label: marker for marker in self.markers}
        for label in labels.values():
            if label not in known:
                raise InputError(f"unknown label '{label}', use some of {', '.join(known)}")
        return replace(self, markers=tuple(replace(known[old], label=new) for new, old in labels.items()))


def layout_names() -> tuple[str, ...]:
    """Return the names of the layouts that come with the program."""
    return tuple(sorted(path.stem for path in resource_folder("markers/models/layouts").glob("*.json")))


def find_layout(name: str) -> Layout:
    """Return an included layout by its name, or that of a user's JSON file.

    Raises:
        InputError: if neither exists, or the file is malformed.
    """
    return Layout.from_json(Path(name) if name.endswith(".json") else _included(name))


def load_layout(name: str, hand: HandShape) -> MarkerModel:
    """Return a hand that wears a layout, named by the hand's side.

    name: of an included layout (`layout_names`), or the path of a JSON file.

    Raises:
        InputError: as `find_layout` and `Layout.on` do.
    """
    return find_layout(name).on(hand)


def _included(name: str) -> Path:
    if name not in layout_names():
        raise InputError(f"unknown marker layout '{name}': use {', '.join(layout_names())} or the path of a .json file")
    return resource_folder("markers/models/layouts") / f"{name}.json"


def _crossings(solid: ImplicitHand, starts: Array, directions: Array, radius: float) -> Array:
    """Return the distance (M,), metres, along each ray to where the skin is `radius` away.

    NaN if there is no such point. It is the first crossing, so that a ray stops at its own finger.
    """
    t = np.arange(0, _FARTHEST, _STEP)
    points = starts[:, None] + t[:, None] * directions[:, None]
    beyond = solid.distance(points.reshape(-1, 3)).reshape(len(starts), -1) - radius
    first = np.argmax(beyond > 0, axis=1)
    rays, before = np.arange(len(starts)), np.maximum(first - 1, 0)
    low, high, below, above = t[before], t[first], beyond[rays, before], beyond[rays, first]
    # The distance is all but linear along so short a bracket.
    for _ in range(_SECANTS):
        found = low - below * (high - low) / np.where(first > 0, above - below, 1)
        value = solid.distance(starts + found[:, None] * directions) - radius
        out = value > 0
        low, below = np.where(out, low, found), np.where(out, below, value)
        high, above = np.where(out, found, high), np.where(out, value, above)
    return np.where(first > 0, found, np.nan)

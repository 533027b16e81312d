"""Where to stick the markers of a layout, in words."""

from typing import NamedTuple

import numpy as np

from depthtrack.hand.pose import FINGERS
from depthtrack.hand.shape import HandShape
from depthtrack.markers.models.layout import Layout
from depthtrack.markers.models.skin_marker import BONES, SkinMarker, bone_length

_ENDS = {
    "thumb_metacarpal": ("the joint at the wrist", "the MCP joint"),
    "thumb_proximal": ("the MCP joint", "the IP joint"),
    "thumb_distal": ("the IP joint", "the tip"),
    "metacarpal": ("the wrist", "the knuckle"),
    "proximal": ("the knuckle", "the PIP joint"),
    "middle": ("the PIP joint", "the DIP joint"),
    "distal": ("the DIP joint", "the tip"),
}
"""Near and far end of a bone."""
_ASIDE = np.radians(12.0)
"""Angle about a bone from which a marker is off its back."""


class Instruction(NamedTuple):
    """Place of a marker.

    joint: end of the bone that is nearer, with "the".
    distance: of the marker from it along the bone, metres.
    text: the whole sentence.
    """

    label: str
    bone: str
    joint: str
    distance: float
    text: str


def instructions(layout: Layout, hand: HandShape) -> tuple[Instruction, ...]:
    """Return the place of each marker on a hand."""
    return tuple(_instruction(marker, hand) for marker in layout.markers)


def _instruction(marker: SkinMarker, hand: HandShape) -> Instruction:
    finger, phalanx = BONES[marker.bone]
    name, bone = FINGERS[finger], marker.bone.partition("_")[2]
    near, far = _ENDS.get(marker.bone, _ENDS.get(bone, ("", "")))
    length = bone_length(hand, marker.bone)
    from_near = marker.along < 0.5 or far == "the tip"
    joint, other = (near, far) if from_near else (far, near)
    distance = (marker.along if from_near else 1 - marker.along) * length
    digit = "thumb" if finger == 0 else f"{name} finger"
    where = f"back of the hand, over the {bone} of the {digit}" if phalanx < 0 else f"{digit}, {bone} bone"
    place = f"{1000 * distance:.0f} mm from {joint} towards {other}" if distance >= 0.0005 else f"at {joint}"
    text = f"{where}: {place}, {_side(marker, finger)}"
    return Instruction(marker.label, marker.bone, joint, distance, text)


def _side(marker: SkinMarker, finger: int) -> str:
    back = "the nail's side" if finger == 0 else "the back"
    if abs(marker.around) < _ASIDE:
        return f"on {back}"
    side = ("palm" if marker.around > 0 else "back of the hand") if finger == 0 else None
    towards = side or ("thumb" if marker.around > 0 else "little finger")
    return f"{abs(np.degrees(marker.around)):.0f} degrees from {back} towards the {towards}"

"""Layouts chosen by hand, in the manner of Hoyet, Ryall, McDonnell and O'Sullivan 2012.

Their names count the markers on the fingers (F) and the thumb (T).
"""

from collections.abc import Mapping

from depthtrack.errors import InputError
from depthtrack.markers.layout.candidates import SPREAD
from depthtrack.markers.models.layout import Layout
from depthtrack.markers.models.skin_marker import SkinMarker

_TIPS = ("index_distal", "middle_distal", "ring_distal", "little_distal")
MANUAL_BONES: Mapping[str, tuple[str, ...]] = {
    "3F-1T": ("thumb_distal", "index_distal", "ring_distal", "little_distal"),
    "4F-1T": ("thumb_distal", *_TIPS),
    "4F-2T": ("thumb_distal", "thumb_proximal", *_TIPS),
    "6F-2T": ("thumb_distal", "thumb_proximal", *_TIPS, "index_proximal", "little_proximal"),
    "8F-2T": (
        "thumb_distal",
        "thumb_proximal",
        *_TIPS,
        "index_proximal",
        "middle_proximal",
        "ring_proximal",
        "little_proximal",
    ),
}
"""Bones with a marker on the middle of their back."""


def manual_layout(name: str, radius: float = 0.003) -> Layout:
    """Return a layout by its name.

    radius: of the markers, metres.

    Raises:
        InputError: if there is no such layout.
    """
    if name not in MANUAL_BONES:
        raise InputError(f"there is no manual layout '{name:.40}': use {', '.join(MANUAL_BONES)}")
    markers = tuple(SkinMarker(bone, bone, 0.5, 0.0, SPREAD) for bone in MANUAL_BONES[name])
    return Layout(f"{name}, in the manner of Hoyet et al. 2012", radius, markers)

"""What a person reads of a layout: places in words, the page, and markers that cameras miss."""

import numpy as np

from depthtrack.hand.shape import HandShape
from depthtrack.markers.layout.candidates import Candidates
from depthtrack.markers.layout.instructions import instructions
from depthtrack.markers.layout.occlusion import camera_directions, hidden_shares
from depthtrack.markers.models.layout import Layout
from depthtrack.markers.models.skin_marker import SkinMarker
from depthtrack.types import Array
from depthtrack.viewing.layout_sheet import PAGE, layout_sheet


def test_places_are_stated_from_the_nearer_joint() -> None:
    markers = (
        SkinMarker("a", "index_proximal", 0.25, 0.0, 0.002),
        SkinMarker("b", "index_proximal", 0.75, np.radians(30), 0.002),
        SkinMarker("c", "little_distal", 0.9, np.radians(-20), 0.002),
        SkinMarker("d", "thumb_proximal", 0.0, np.radians(40), 0.002),
        SkinMarker("e", "ring_metacarpal", 0.5, 0.0, 0.002),
    )
    texts = [place.text for place in instructions(Layout("", 0.003, markers), HandShape())]
    assert texts == [
        "index finger, proximal bone: 10 mm from the knuckle towards the PIP joint, on the back",
        "index finger, proximal bone: 10 mm from the PIP joint towards the knuckle, "
        "30 degrees from the back towards the thumb",
        "little finger, distal bone: 18 mm from the DIP joint towards the tip, "
        "20 degrees from the back towards the little finger",
        "thumb, proximal bone: at the MCP joint, 40 degrees from the nail's side towards the palm",
        "back of the hand, over the metacarpal of the ring finger: 44 mm from the knuckle towards the wrist, "
        "on the back",
    ]


def test_the_page_has_both_views_and_all_places(candidates: Candidates) -> None:
    layout = candidates.layout([5, 700], "two markers", anchored=True)
    page = layout_sheet(layout.on(candidates.hand), "two markers", ["one", "two", "wrist"], ["figures"])
    assert page.shape == (PAGE[1], PAGE[0], 3)
    red = (page[..., 0] > 180) & (page[..., 1] < 60)
    assert red[:, : PAGE[0] // 2].sum() > 200
    assert red[:, PAGE[0] // 2 :].sum() > 200


def test_places_of_26_markers_fit_on_the_page(candidates: Candidates) -> None:
    model = candidates.layout([5, 700], "two markers", anchored=True).on(candidates.hand)
    place = "back of the hand, over the metacarpal of the little finger: 18 mm from the wrist towards the knuckle"
    assert layout_sheet(model, "26 markers", [place] * 27, ["figures"] * 5).shape == (PAGE[1], PAGE[0], 3)


def test_cameras_above_see_the_back_and_cameras_below_do_not(candidates: Candidates, postures: Array) -> None:
    above = camera_directions(3)
    flat = 0 * postures[:1]
    seen = hidden_shares(candidates, flat, above, turns=(0.0,))
    assert seen.mean() < 0.2
    assert hidden_shares(candidates, flat, above * [1, -1, 1], turns=(0.0,)).mean() > 0.8

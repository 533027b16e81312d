"""Pages of hand synergies (as Fig. 6 of Schroeder et al. 2014)."""

import numpy as np

from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.skin.mesh import Skin
from depthtrack.hand.synergies import Synergies
from depthtrack.types import Image
from depthtrack.viewing.contact_sheet import framed
from depthtrack.viewing.hand_picture import hand_picture
from depthtrack.viewing.panels import beside, blank, captioned, stacked
from depthtrack.viewing.text import put_text
from depthtrack.viewing.theme import FAINT_TEXT, TEXT

STEPS = (-2.0, -1.0, 0.0, 1.0, 2.0)
"""Standard deviations from the mean posture."""
_LABEL_WIDTH = 170


def synergy_sheet(synergies: Synergies, skin: Skin, count: int = 4, size: int = 260) -> Image:
    """Return a page (h, w, 3) with one row for each of the first `count` components.

    A row shows the hand from -2 to +2 standard deviations, within the recorded range of the component and the joint
    limits.
    """
    rows = [_row(synergies, skin, k, size) for k in range(min(count, len(synergies)))]
    return framed(stacked([_title(synergies, rows[0].shape[1]), *rows], gap=10))


def _row(synergies: Synergies, skin: Skin, k: int, size: int) -> Image:
    deviation = float(np.sqrt(synergies.variances[k]))
    tiles = []
    for step in STEPS:
        coefficient = float(np.clip(step * deviation, synergies.lower[k], synergies.upper[k]))
        coefficients = np.zeros(len(synergies))
        coefficients[k] = coefficient
        picture = hand_picture(skin, np.clip(synergies.angles(coefficients), LOWER, UPPER), size)
        actual = coefficient / deviation if deviation > 0 else 0.0
        name = "mean" if step == 0 else f"{actual:+.1f} sd"
        tiles.append(captioned(picture, name, "" if abs(actual - step) < 1e-6 else "end of recorded range"))
    label = blank(_LABEL_WIDTH, tiles[0].shape[0])
    middle = label.shape[0] // 2
    put_text(label, f"component {k + 1}", (8, middle - 34), 20, TEXT)
    share = synergies.variance_share(k + 1) - synergies.variance_share(k)
    put_text(label, f"{share:.1%} of the variance", (8, middle), 14, FAINT_TEXT)
    put_text(label, f"{synergies.variance_share(k + 1):.1%} cumulative", (8, middle + 24), 14, FAINT_TEXT)
    return beside([label, *tiles])


def _title(synergies: Synergies, width: int) -> Image:
    bar = blank(width, 64)
    put_text(bar, "Hand synergies", (8, 18), 26, TEXT)
    put_text(bar, synergies.source, (8, 48), 14, FAINT_TEXT)
    return bar

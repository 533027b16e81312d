"""Colours of the report page: one per tracker everywhere, for light and dark mode.

Plots are drawn in placeholder colours, such as "second tracker" or "text". The page replaces them by CSS variables.
"""

import re
from dataclasses import dataclass

from depthtrack.viewing.theme import Rgb

INK, FAINT, GRID, PAPER = "#010101", "#020202", "#030303", "#040404"
"""Placeholders for text, secondary text, grid lines and the background."""

_NAMES = {INK: "ink", FAINT: "faint", GRID: "grid", PAPER: "card"}


@dataclass(frozen=True)
class TrackerColour:
    """A tracker's CSS colour on a light and on a dark background."""

    light: str
    dark: str

    @property
    def rgb(self) -> Rgb:
        """Return the colour for images, whose background is dark."""
        red, green, blue = (int(self.dark[k : k + 2], 16) for k in (1, 3, 5))
        return red, green, blue


# Hues of Okabe and Ito (2008), distinct with colour vision deficiency; lighter on a dark background.
TRACKER_COLOURS = (
    TrackerColour("#0072b2", "#56b4e9"),
    TrackerColour("#d55e00", "#ff8f45"),
    TrackerColour("#008f68", "#2fc79a"),
    TrackerColour("#a8467f", "#e391c3"),
    TrackerColour("#9a6a00", "#f0c04a"),
    TrackerColour("#555f6b", "#b4bfca"),
)


def tracker_colour(number: int) -> TrackerColour:
    """Return the colour of a tracker by its number; colours repeat from the seventh on."""
    return TRACKER_COLOURS[number % len(TRACKER_COLOURS)]


def placeholder(number: int) -> str:
    """Return the placeholder of a tracker's colour."""
    return f"#05{number % len(TRACKER_COLOURS):02x}05"


def with_variables(svg: str) -> str:
    """Replace the placeholders in an SVG by CSS variables."""
    variables = {colour: f"var(--{name})" for colour, name in _NAMES.items()}
    variables |= {placeholder(number): f"var(--tracker-{number})" for number in range(len(TRACKER_COLOURS))}
    return re.sub("|".join(variables), lambda found: variables[found[0]], svg)


def css_variables(dark: bool) -> str:
    """Return the trackers' colours as CSS declarations."""
    return " ".join(f"--tracker-{n}: {c.dark if dark else c.light};" for n, c in enumerate(TRACKER_COLOURS))

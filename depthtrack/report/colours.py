"""Colours of the page: a tracker keeps its own in every plot, picture and film; all follow the reader's light or dark.

Plots are drawn in stand-in colours that mean "the second tracker" or "text"; in the page they become CSS variables.
"""

import re
from dataclasses import dataclass

from depthtrack.viewing.theme import Rgb

INK, FAINT, GRID, PAPER = "#010101", "#020202", "#030303", "#040404"
"""Stand-ins for text, quiet text, lines of a grid, and the ground."""

_NAMES = {INK: "ink", FAINT: "faint", GRID: "grid", PAPER: "card"}


@dataclass(frozen=True)
class TrackerColour:
    """One tracker's colour as CSS has it, on a light and on a dark ground."""

    light: str
    dark: str

    @property
    def rgb(self) -> Rgb:
        """For pictures, which are dark."""
        red, green, blue = (int(self.dark[k : k + 2], 16) for k in (1, 3, 5))
        return red, green, blue


# The hues of Okabe and Ito (2008), which most eyes tell apart; lighter on a dark ground.
TRACKER_COLOURS = (
    TrackerColour("#0072b2", "#56b4e9"),
    TrackerColour("#d55e00", "#ff8f45"),
    TrackerColour("#008f68", "#2fc79a"),
    TrackerColour("#a8467f", "#e391c3"),
    TrackerColour("#9a6a00", "#f0c04a"),
    TrackerColour("#555f6b", "#b4bfca"),
)


def tracker_colour(number: int) -> TrackerColour:
    """The colour of the tracker of this number; from the seventh on, they come again."""
    return TRACKER_COLOURS[number % len(TRACKER_COLOURS)]


def stand_in(number: int) -> str:
    """The stand-in for a tracker's colour."""
    return f"#05{number % len(TRACKER_COLOURS):02x}05"


def with_variables(svg: str) -> str:
    """The drawing with CSS variables in place of the stand-ins."""
    variables = {colour: f"var(--{name})" for colour, name in _NAMES.items()}
    variables |= {stand_in(number): f"var(--tracker-{number})" for number in range(len(TRACKER_COLOURS))}
    return re.sub("|".join(variables), lambda found: variables[found[0]], svg)


def css_variables(dark: bool) -> str:
    """The trackers' colours as CSS declarations."""
    return " ".join(f"--tracker-{n}: {c.dark if dark else c.light};" for n, c in enumerate(TRACKER_COLOURS))

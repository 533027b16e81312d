"""Marks of a marker scene: dots, rings, crosses, lines and names.

Pictures are drawn in a multiple of their size, except for the names.
"""

from itertools import combinations
from typing import NamedTuple

import cv2
import numpy as np

from depthtrack.types import Array, Image
from depthtrack.viewing.panels import blank, smaller
from depthtrack.viewing.text import put_text, text_width
from depthtrack.viewing.text_placement import place_names
from depthtrack.viewing.theme import OUTLINE, TEXT, Rgb

SUPERSAMPLING = 2
"""Resolution of drawing relative to the picture."""
_NAME_SIZE = 12
"""Height of a name, pixels."""
_DOT, _BESIDE = 6.0, 11.0
"""Radius of a dot with its rim, and distance of a name from which a line joins both, pixels."""
_STUB = 6 * SUPERSAMPLING
"""Half the length of a line in the legend, pixels of a drawing."""
_LEGEND = (
    ("dot", "measured"),
    ("dark", "measured, behind the hand"),
    ("ring", "from the pose"),
    ("line", "to the marker of the pose"),
    ("cross", "without a label"),
)
_RIM = ((-1, -1), (-1, 1), (1, -1), (1, 1), (0, -1), (0, 1), (-1, 0), (1, 0))
"""Offsets of the dark rim of a name, pixels."""
_FIXED_POINT = 4
"""Bits of a pixel's fraction in OpenCV's drawing functions."""
_MOST_EDGES = 8
"""Markers of a rigid body that are joined by lines, at most."""


class NamedDot(NamedTuple):
    """A drawn marker: its name, pixel (2,) and colour."""

    name: str
    pixel: Array
    colour: Rgb


def draw_cross(image: Image, pixel: Array, colour: Rgb) -> None:
    """Draw a point without a label."""
    size = 3 * SUPERSAMPLING
    for line, width in ((OUTLINE, 3 * SUPERSAMPLING), (colour, SUPERSAMPLING)):
        for step in ([size, size], [size, -size]):
            cv2.line(image, _fixed(pixel - step), _fixed(pixel + step), line, width, cv2.LINE_AA, _FIXED_POINT)


def draw_dot(image: Image, pixel: Array, colour: Rgb, measured: bool, hidden: bool) -> None:
    """Draw a marker: a dot if it was measured, else a ring; darker if the hand hides it."""
    radius, rim = 4 * SUPERSAMPLING << _FIXED_POINT, (3 * SUPERSAMPLING << _FIXED_POINT) // 2
    centre = _fixed(pixel)
    shade = tuple(int(0.45 * part) for part in colour) if hidden else colour
    cv2.circle(image, centre, radius + rim, OUTLINE, -1, cv2.LINE_AA, _FIXED_POINT)
    if measured:
        cv2.circle(image, centre, radius, shade, -1, cv2.LINE_AA, _FIXED_POINT)
    else:
        cv2.circle(image, centre, radius, shade, SUPERSAMPLING, cv2.LINE_AA, _FIXED_POINT)


def draw_offset(image: Image, pixel: Array, expected: Array, colour: Rgb) -> None:
    """Draw a line from a marker to the place that the pose gives it."""
    if np.isfinite(expected).all():
        cv2.line(image, _fixed(pixel), _fixed(expected), OUTLINE, 3 * SUPERSAMPLING, cv2.LINE_AA, _FIXED_POINT)
        cv2.line(image, _fixed(pixel), _fixed(expected), colour, SUPERSAMPLING, cv2.LINE_AA, _FIXED_POINT)


def draw_edges(image: Image, pixels: Array, colour: Rgb) -> None:
    """Draw lines between the markers of a rigid body."""
    known = pixels[np.isfinite(pixels).all(axis=1)]
    for a, b in combinations(known[:_MOST_EDGES], 2):
        cv2.line(image, _fixed(a), _fixed(b), colour, SUPERSAMPLING, cv2.LINE_AA, _FIXED_POINT)


def draw_names(image: Image, dots: list[NamedDot]) -> None:
    """Write the names beside the markers in a picture of its final size."""
    size = _NAME_SIZE
    pixels = np.array([dot.pixel for dot in dots]).reshape(-1, 2)
    boxes = np.array([[text_width(dot.name, size), size] for dot in dots], dtype=np.float64).reshape(-1, 2)
    corners = place_names(pixels, boxes, image.shape[:2], clearance=10)
    for dot, corner, box in zip(dots, corners, boxes, strict=True):
        nearest = np.clip(dot.pixel, corner, corner + box)
        away = nearest - dot.pixel
        if (length := float(np.linalg.norm(away))) > _BESIDE:
            begin = _fixed(dot.pixel + away * _DOT / length)
            for colour, width in ((OUTLINE, 3), (dot.colour, 1)):
                cv2.line(image, begin, _fixed(nearest), colour, width, cv2.LINE_AA, _FIXED_POINT)
    for dot, corner in zip(dots, corners, strict=True):
        x, y = round(corner[0]), round(corner[1] + size / 2)
        for dx, dy in _RIM:
            put_text(image, dot.name, (x + dx, y + dy), size, OUTLINE)
        put_text(image, dot.name, (x, y), size, _pale(dot.colour))


def draw_legend(width: int, height: int, size: int, colours: tuple[Rgb, Rgb], text_colour: Rgb) -> Image:
    """Return a bar with each mark and its meaning.

    size: height of the text, pixels.
    colours: of a marker, and of a point without a label.
    """
    colour, unlabelled = colours
    image = blank(width * SUPERSAMPLING, height * SUPERSAMPLING)
    x, words = 10.0, []
    for mark, text in _LEGEND:
        at = np.array([x, height / 2]) * SUPERSAMPLING
        if mark == "cross":
            draw_cross(image, at, unlabelled)
        else:
            at[0] -= _STUB if mark == "line" else 0
            draw_offset(image, at, at + np.array([2 * _STUB, 0]) if mark == "line" else at, colour)
            draw_dot(image, at, colour, mark != "ring", mark == "dark")
        words.append((text, (round(x) + 14, height // 2)))
        x += 14 + text_width(text, size) + 26
    bar = smaller(image, width, height)
    for text, place in words:
        put_text(bar, text, place, size, text_colour)
    return bar


def _pale(colour: Rgb) -> Rgb:
    """Return a colour half way to that of text."""
    red, green, blue = ((part + other) // 2 for part, other in zip(colour, TEXT, strict=True))
    return red, green, blue


def _fixed(pixel: Array) -> tuple[int, int]:
    x, y = np.rint(np.clip(pixel, -1e5, 1e5) * (1 << _FIXED_POINT)).astype(int)
    return int(x), int(y)

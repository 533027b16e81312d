"""One page of a marker layout: the hand from back and side, and where to stick the markers."""

from collections.abc import Sequence

import cv2
import numpy as np

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rotations import quaternion_exp, quaternion_product
from depthtrack.hand.pose import make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.skin.mesh import Skin
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.rendering.triangles import rasterise
from depthtrack.types import Array, Image
from depthtrack.viewing.panels import beside, blank, smaller, stacked
from depthtrack.viewing.shading import draw_surface
from depthtrack.viewing.text import put_text, text_width
from depthtrack.viewing.text_placement import place_names
from depthtrack.viewing.theme import Rgb

PAGE = (1240, 1754)
"""Width and height of the page: A4 at 150 dots per inch."""
_PAPER: Rgb = (255, 255, 255)
_INK: Rgb = (20, 20, 20)
_GREY: Rgb = (105, 105, 105)
_MARKER: Rgb = (200, 30, 30)
_MARGIN, _GAP = 60, 20
_COLUMNS = ((1, 21, 38), (2, 18, 31), (2, 15, 24))
"""Columns, size of the text and height of a line of the list of places, pixels; the first that fits is used."""
_DISTANCE, _SPAN = 1.0, 0.25
"""Distance and side of the picture at the hand, metres, for a hand of scale 1."""
_SUPERSAMPLING = 3
_BEHIND = 0.006
"""Depth behind the skin from which a marker is hidden, metres."""


def layout_sheet(model: MarkerModel, title: str, places: Sequence[str], figures: Sequence[str]) -> Image:
    """Return the page (h, w, 3), white, to print.

    places: a sentence for each marker.
    figures: lines below them.
    """
    assert model.hand is not None
    skin = Skin.of(model.hand)
    side = (PAGE[0] - 2 * _MARGIN - _GAP) // 2
    # Fingers up; the back of the hand faces the camera, then the side of the thumb.
    up = quaternion_exp([np.pi, 0, 0])
    back = quaternion_product(quaternion_exp([0, np.pi, 0]), up)
    turned = quaternion_product(quaternion_exp([0, -np.radians(62) * model.hand.mirror, 0]), back)
    views = [_view(model, skin, quaternion, side) for quaternion in (back, turned)]
    names = [_line("back", side, 22, _GREY), _line("side of the thumb", side, 22, _GREY)]
    width = PAGE[0] - 2 * _MARGIN
    rows = [_line(text, width, 34, _INK, 64) for text in _wrapped(title, width, 34)]
    columns = [stacked([name, view], gap=0) for name, view in zip(names, views, strict=True)]
    rows.append(_white_gap(beside(columns, gap=_GAP)))
    below = [_line("", width, 20, _GREY, 16), *(_line(text, width, 20, _GREY, 32) for text in figures)]
    room = PAGE[1] - 2 * _MARGIN - sum(len(row) for row in (*rows, *below))
    content = np.concatenate([*rows, _list(places, width, room), *below], axis=0)
    page = blank(PAGE[0], max(PAGE[1], len(content) + 2 * _MARGIN), _PAPER)
    page[_MARGIN : _MARGIN + len(content), _MARGIN : _MARGIN + content.shape[1]] = content
    return page


def _view(model: MarkerModel, skin: Skin, quaternion: Array, side: int) -> Image:
    """Return a square picture of the open hand with numbered markers; a ring is behind the hand."""
    fine = side * _SUPERSAMPLING
    focal = fine * _DISTANCE / (_SPAN * skin.shape.scale)
    camera = Camera(fine, fine, focal, focal, fine / 2, fine / 2)
    pose = make_pose([0, 0, _DISTANCE], quaternion, POSTURES["open"])
    vertices = skin.at(pose)
    shift = np.append((vertices[:, :2].min(axis=0) + vertices[:, :2].max(axis=0)) / 2, 0)
    vertices = vertices - shift
    surface = rasterise(camera, vertices, skin.faces, skin.normals(vertices), skin.face_bodies)
    image = draw_surface(blank(fine, fine, _PAPER), surface, 0.75)
    points = model.positions(pose) - shift
    pixels = camera.project(points)
    radius = round(focal * 0.004 / _DISTANCE)
    for point, pixel in zip(points, pixels, strict=True):
        x, y = (int(value) for value in np.clip(np.rint(pixel), 0, fine - 1))
        hidden = 0 < surface.depth[y, x] < point[2] - _BEHIND
        cv2.circle(image, (x, y), radius, _MARKER, 4 if hidden else -1, cv2.LINE_AA)
    image = smaller(image, side, side)
    _number(image, pixels / _SUPERSAMPLING)
    return image


def _number(image: Image, pixels: Array) -> None:
    """Write the numbers 1, 2 ... beside the markers."""
    size, names = 22, [str(n + 1) for n in range(len(pixels))]
    boxes = np.array([[text_width(name, size), size] for name in names], dtype=np.float64)
    corners = place_names(pixels, boxes, image.shape[:2], clearance=12)
    for name, corner, box, pixel in zip(names, corners, boxes, pixels, strict=True):
        nearest = np.clip(pixel, corner, corner + box)
        ends = [(round(float(x)), round(float(y))) for x, y in (pixel, nearest)]
        if np.linalg.norm(nearest - pixel) > 18:
            cv2.line(image, ends[0], ends[1], _GREY, 1, cv2.LINE_AA)
        put_text(image, name, (round(float(corner[0])), round(float(corner[1]) + size / 2)), size, _INK)


def _line(text: str, width: int, size: int, colour: Rgb, height: int = 36) -> Image:
    bar = blank(width, height, _PAPER)
    put_text(bar, text, (0, height // 2), size, colour)
    return bar


def _list(places: Sequence[str], width: int, room: int) -> Image:
    """Return the numbered places, in two columns and small if they need more than `room` pixels."""
    image = blank(width, 1, _PAPER)
    for columns, size, height in _COLUMNS:
        wide = (width - (columns - 1) * _GAP) // columns
        blocks = [_wrapped(f"{number}   {place}", wide, size) for number, place in enumerate(places, start=1)]
        parts: list[list[str]] = [[] for _ in range(columns)]
        part, each = 0, -(-sum(map(len, blocks)) // columns)
        for block in blocks:
            part += len(parts[part]) >= each
            parts[part] += block
        image = blank(width, height * max(map(len, parts)), _PAPER)
        for k, lines in enumerate(parts):
            for n, text in enumerate(lines):
                bar = _line(text, wide, size, _INK, height)
                image[n * height : (n + 1) * height, k * (wide + _GAP) :][:, :wide] = bar
        if len(image) <= room:
            break
    return image


def _wrapped(text: str, width: int, size: int) -> list[str]:
    lines = [""]
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}" if lines[-1] else word
        if text_width(longer, size) > width and lines[-1].strip():
            lines.append(f"      {word}")
        else:
            lines[-1] = longer
    return lines


def _white_gap(image: Image) -> Image:
    """Return the image with the page's colour between its two halves."""
    middle = image.shape[1] // 2
    image[:, middle - _GAP // 2 : middle + _GAP // 2] = _PAPER
    return image

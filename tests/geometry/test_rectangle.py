"""Rectangles: bounding boxes, crops and pastes agree with plain loops over pixels."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect

EDGES = st.integers(-12, 24)
RECTS = st.builds(lambda x, y, w, h: Rect.of_size(x, y, w, h), EDGES, EDGES, st.integers(0, 15), st.integers(0, 15))
IMAGE = np.arange(1, 12 * 9 + 1, dtype=np.int64).reshape(9, 12)


def pixels(rect: Rect) -> set[tuple[int, int]]:
    return {(x, y) for x in range(rect.left, rect.right) for y in range(rect.top, rect.bottom)}


@given(RECTS)
def test_a_crop_has_the_images_pixels_and_zeros_outside(rect: Rect) -> None:
    part = rect.crop(IMAGE)
    assert part.shape == rect.shape
    for x, y in pixels(rect):
        inside = 0 <= x < 12 and 0 <= y < 9
        assert part[y - rect.top, x - rect.left] == (IMAGE[y, x] if inside else 0)


@given(RECTS, RECTS)
def test_a_pasted_crop_has_the_image_in_the_common_part(rect: Rect, outer: Rect) -> None:
    canvas = rect.paste(rect.crop(IMAGE), outer)
    for x, y in pixels(outer):
        shown = (x, y) in pixels(rect) and 0 <= x < 12 and 0 <= y < 9
        assert canvas[y - outer.top, x - outer.left] == (IMAGE[y, x] if shown else 0)


@given(RECTS, RECTS)
def test_clipping_is_the_intersection(rect: Rect, outer: Rect) -> None:
    assert pixels(rect.clipped(outer)) == pixels(rect) & pixels(outer)


@given(st.lists(st.tuples(st.integers(0, 11), st.integers(0, 8)), max_size=6), st.integers(0, 4))
def test_the_bounding_box_is_the_smallest_that_holds_the_mask(points: list[tuple[int, int]], margin: int) -> None:
    mask = np.zeros((9, 12), dtype=np.bool_)
    for x, y in points:
        mask[y, x] = True
    box = Rect.bounding(mask)
    assert box.is_empty == (not points)
    if points:
        assert box == Rect.around(points)
        assert pixels(box.grown(margin)) >= pixels(box)
        assert box.grown(margin).shape == (box.height + 2 * margin, box.width + 2 * margin)


@given(RECTS, RECTS)
def test_relative_coordinates_are_invertible(rect: Rect, outer: Rect) -> None:
    assert rect.relative_to(outer).shifted(outer.left, outer.top) == rect


@given(
    st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(0.2, 2)),
    st.floats(0.01, 0.3),
    st.tuples(st.floats(-1, 1), st.floats(-1, 1)),
)
def test_the_region_around_a_point_contains_all_near_points(
    centre: tuple[float, float, float], reach: float, step: tuple[float, float]
) -> None:
    camera = Camera(96, 64, 80.0, 70.0, 47.5, 31.5)
    region = camera.rect_around(centre, reach)
    assert not region.is_empty
    assert region.clipped(camera.rect) == region
    u, v = camera.project(np.array(centre) + 0.999 * reach * np.array([*step, 0.0]))
    if 0 <= u < 95 and 0 <= v < 63:
        assert region.left <= u + 1e-9
        assert u < region.right
        assert region.top <= v + 1e-9
        assert v < region.bottom

"""Labels of pixels: the kernel against the definition."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.segmentation.options import GridOptions
from depthtrack.segmentation.pixel_labels import (
    ARM,
    ATTACHED,
    BACKGROUND,
    HAND,
    MISSING,
    NOTHING,
    OTHER,
    READING,
    classify_pixels,
)

MAX_JUMP = GridOptions().max_jump


def slow_kind(
    z: float,
    pixel: tuple[int, int],
    camera: Camera,
    nodes: np.ndarray,
    labels: np.ndarray,
    stride: int,
    plane: np.ndarray,
) -> int:
    """Return the kind of one pixel by the definition."""
    u, v = pixel
    i, j = v // stride, u // stride
    around = [
        (k, m)
        for k in range(max(i - 1, 0), min(i + 2, labels.shape[0]))
        for m in range(max(j - 1, 0), min(j + 2, labels.shape[1]))
        if labels[k, m] != BACKGROUND and (z == 0 or abs(nodes[k, m] - np.float32(z)) < np.float32(MAX_JUMP))
    ]
    if not around:
        return NOTHING
    labelled = [node for node in around if labels[node] != ATTACHED]
    if not labelled:
        return OTHER if z > 0 else NOTHING
    if z > 0:
        best = min(labelled, key=lambda node: abs(nodes[node] - np.float32(z)))
    else:
        best = min(labelled, key=lambda node: (node[0] - i) ** 2 + (node[1] - j) ** 2)
    hand = labels[best] == HAND
    if {HAND, ARM} <= {int(labels[node]) for node in around}:
        point = camera.unproject((u, v), z if z > 0 else float(nodes[best]))
        hand = bool(point @ plane[:3] <= plane[3])
    return (READING if hand else OTHER) if z > 0 else (MISSING if hand else NOTHING)


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_kinds_of_pixels_equal_the_definition(seed: int) -> None:
    rng = np.random.default_rng(seed)
    camera, stride = Camera(24, 20, 40.0, 41.0, 11.0, 9.0), 4
    nodes = rng.uniform(0.5, 0.58, (5, 6)).astype(np.float32)
    labels = rng.choice([BACKGROUND, HAND, HAND, ARM, ATTACHED], (5, 6)).astype(np.uint8)
    nodes[labels == BACKGROUND] = 0
    depth = np.where(rng.random(camera.shape) < 0.3, 0, rng.uniform(0.5, 0.6, camera.shape)).astype(np.float32)
    plane = np.append(rng.normal(size=3), 0.05)
    blocks = Rect(1, 1, 6, 4)
    roi = Rect(4, 4, 24, 16)
    lens = (camera.fx, camera.fy, camera.cx, camera.cy)
    out = np.empty((roi.height, roi.width), np.uint8)
    classify_pixels(depth, tuple(roi), nodes, labels, tuple(blocks), stride, MAX_JUMP, lens, tuple(plane.tolist()), out)
    expected = [
        [
            slow_kind(float(depth[v, u]), (u, v), camera, nodes, labels, stride, plane)
            for u in range(roi.left, roi.right)
        ]
        for v in range(roi.top, roi.bottom)
    ]
    np.testing.assert_array_equal(out, expected)

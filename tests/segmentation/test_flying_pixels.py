"""Flying pixels: found where sensors mix two depths, and not on visible surfaces."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.flying_pixels import flying_pixels
from depthtrack.segmentation.options import FlyingPixelOptions
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.synthesis.generate import Synthesis, Synthesiser

FOCAL = 366.0


def slow_flying_pixels(depth: np.ndarray, focal: float) -> np.ndarray:
    """Return the mask by the definition, pixel by pixel."""
    out = np.zeros(depth.shape, np.bool_)
    for v, u in np.argwhere(depth > 0):
        z = float(depth[v, u])
        most = FlyingPixelOptions().steepest / focal * z
        for line in (depth[v, max(u - 1, 0) : u + 2], depth[max(v - 1, 0) : v + 2, u]):
            beside = line[(line > 0) & (line != depth[v, u])].astype(float)
            out[v, u] |= bool(np.any(z - beside > most) and not np.any(abs(z - beside) <= most))
    return out


@given(seed=st.integers(0, 2**32 - 1))
def test_kernel_equals_the_definition(seed: int) -> None:
    rng = np.random.default_rng(seed)
    depth = np.where(rng.random((9, 11)) < 0.3, 0, 0.6 + 0.03 * rng.random((9, 11))).astype(np.float32)
    assert np.array_equal(flying_pixels(depth, FOCAL), slow_flying_pixels(depth, FOCAL))


def test_rims_and_streaks_are_flying_pixels_and_a_finger_is_not() -> None:
    """A finger is before a wall, with a rim half way between and a streak beyond its tip."""
    depth = np.full((60, 40), 1.2, np.float32)
    across = np.arange(-4, 5) * 0.6 / FOCAL
    depth[20:60, 15:24] = 0.6 - np.sqrt(0.008**2 - np.minimum(np.abs(across), 0.0079) ** 2)
    finger = np.zeros(depth.shape, np.bool_)
    finger[21:59, 15:24] = True
    depth[20:60, 14] = depth[20:60, 24] = 0.8
    depth[10:20, 19] = np.linspace(1.1, 0.7, 10)
    flying = flying_pixels(depth, FOCAL)
    assert flying[21:59, [14, 24]].all()
    assert flying[10:20, 19].all()
    assert not flying[finger].any()


@pytest.mark.parametrize("coloured", [False, True])
def test_observations_by_depth_alone_have_no_flying_pixels(coloured: bool) -> None:
    """Half of the readings beside the outline are flying pixels; few of them remain.

    The segmenter has no skin colours, whether the frame has colour or not.
    """
    made = Synthesiser(Synthesis(sensor="ideal", model="skin", background="none"))
    frame, camera = made[0], made.sensor.camera
    depth, rng = frame.depth.astype(np.float32), np.random.default_rng(1)
    padded = np.pad(frame.mask, 1)
    beside = np.logical_or.reduce([np.roll(padded, step, axis) for step in (-1, 1) for axis in (0, 1)])[1:-1, 1:-1]
    outline = beside & ~frame.mask & (rng.random(depth.shape) < 0.5)
    depth[outline] = frame.depth[frame.mask].max() + 0.05 * rng.uniform(0.5, 1.5, np.count_nonzero(outline))
    o = Segmenter().segment(Frame(0, 0.0, depth, frame.colour if coloured else None, camera))
    assert o is not None
    observed = o.region.paste(o.depth > 0, camera.rect)
    assert np.mean(observed[outline]) < 0.05
    assert np.mean(observed[frame.mask]) > 0.95

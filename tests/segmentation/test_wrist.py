"""Arm and wrist: breadth and direction of a tube seen at any slant, and the wrist's memory."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.primitives import CYLINDER, SPHERE, cone, ellipsoid
from depthtrack.rendering.raycast import raycast
from depthtrack.segmentation.forearm import (
    ARM_HALF_BREADTH,
    BIN,
    BIN_MIDDLES,
    MARGIN,
    Arm,
    area_along,
    breadth,
    find_arm,
    section,
    walk_back,
)
from depthtrack.segmentation.grid import Grid, Paths
from depthtrack.segmentation.palm import Palm, find_palms, palm_near, tips
from depthtrack.segmentation.surface_grid import dilated, disc, eroded, share_of_blocks
from depthtrack.segmentation.wrist import (
    BREADTH_WEIGHT,
    BROAD,
    BROADEST,
    FEWEST_BEHIND,
    FLARE,
    NARROW,
    NEIGHBOURS,
    SPREAD,
    WRIST_TO_PALM,
    WristPlane,
    arm_nodes,
    find_wrist,
    hand_axis,
    likeliest_wrist,
)
from depthtrack.segmentation.wrist_filter import GUESS_SIGMA, HAND_LENGTH, SEEN_SIGMA, SURPRISE, WristFilter

CAMERA = Camera(640, 480, 525.0, 525.0, 319.5, 239.5)
WRIST = 0.055
"""Metres from the palm's centre to where the tube begins to show."""


def club(slant: float) -> tuple[Grid, Palm]:
    """A flat palm, 90 mm across, on a tube 60 mm thick that leads down and, by `slant` radians, away."""
    c, s = np.cos(slant), np.sin(slant)
    turn = np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0.5], [0, 0, 0, 1.0]])
    palm = ellipsoid((0.0, -0.01, 0.0), (0.045, 0.055, 0.030))
    fingertip = ellipsoid((0.0, -0.07, 0.0), (0.012, 0.05, 0.012))
    tube = cone((0.0, 0.0, 0.0), 0.4, 0.030, 0.032)
    placed = np.stack([turn @ part for part in (palm, fingertip, tube)])
    depth = raycast(CAMERA, np.array([SPHERE, SPHERE, CYLINDER]), placed, np.arange(3)).depth.astype(np.float32)
    grid = Grid.over(depth, CAMERA, CAMERA.rect, (0.2, 0.95), 5)
    # The tube's other end is free too, and about as broad.
    return grid, min(find_palms(grid, grid), key=lambda palm: float(np.linalg.norm(palm.centre - [0, 0, 0.5])))


@pytest.mark.parametrize("degrees", [0, 30, 50])
def test_arm_and_wrist_of_a_club_at_any_slant(degrees: float) -> None:
    slant = np.radians(degrees)
    grid, palm = club(slant)
    assert palm.radius == pytest.approx(0.045 * (1 if degrees < 40 else np.cos(slant) ** 0.5), abs=0.008)
    arm = find_arm(grid, palm, WRIST)
    assert arm is not None
    axis = np.array([0.0, np.cos(slant), np.sin(slant)])
    assert arm.direction @ axis > np.cos(np.radians(12))
    seen = breadth(grid, palm, arm)
    tube = (BIN_MIDDLES > 0.07) & (BIN_MIDDLES < 0.15)
    # Nodes at the outline are lost, the more so where the tube is farther away.
    np.testing.assert_allclose(seen[tube], 0.061, atol=0.013)
    assert np.ptp(seen[tube]) < 0.008
    wrist = find_wrist(grid, palm, arm, WRIST)
    assert wrist is not None
    assert wrist == pytest.approx(0.04, abs=0.02)


def test_what_is_cut_is_the_arm_alone() -> None:
    grid, palm = club(0.0)
    arm = find_arm(grid, palm, WRIST)
    assert arm is not None
    plane = WristPlane(palm.centre + WRIST * arm.direction, arm.direction)
    cut = arm_nodes(grid, palm, arm, plane)
    below = ((grid.points - plane.point) @ plane.normal > 0).reshape(grid.depth.shape) & (grid.depth > 0)
    np.testing.assert_array_equal(cut, below & palm.paths.reached())
    assert cut.sum() > 100


def test_no_arm_is_seen_of_a_palm_alone() -> None:
    depth = raycast(
        CAMERA, np.array([SPHERE]), ellipsoid((0, 0, 0.5), (0.045, 0.09, 0.03))[None], np.array([0])
    ).depth.astype(np.float32)
    grid = Grid.over(depth, CAMERA, CAMERA.rect, (0.2, 0.95), 5)
    palm = palm_near(grid, grid, next(tips(grid)))
    assert palm is not None
    assert find_arm(grid, palm, WRIST) is None


def palm_at(x: float, radius: float = 0.04, tip_distance: float = 0.1) -> Palm:
    nothing = Paths(np.zeros((0, 0), np.float32), np.zeros((0, 0), np.int32))
    return Palm(0, np.array([x, 0.0, 0.5]), radius, tip_distance, nothing, ())


ARM = Arm(np.array([1.0, 0.0, 0.0]), np.zeros(0, np.int64))


def test_the_first_sight_of_a_wrist_is_believed() -> None:
    assert WristFilter().update(palm_at(0), ARM, 0.07) == pytest.approx(0.07)
    assert WristFilter().update(palm_at(0), ARM, None) == pytest.approx(WRIST_TO_PALM)
    # Of a hand on edge, only its length is known.
    assert WristFilter().update(palm_at(0, radius=0.015), ARM, None) == pytest.approx(HAND_LENGTH - 0.1)


def test_the_wrist_stays_where_it_is_while_the_palm_is_mistaken() -> None:
    wrist = WristFilter()
    for _ in range(5):
        wrist.update(palm_at(0.0), ARM, 0.06)
    # The widest place jumps to the fingers, and the wrist is not seen.
    assert wrist.update(palm_at(-0.05, radius=0.015), ARM, None) == pytest.approx(0.11, abs=0.005)
    assert wrist.guess(palm_at(-0.05)) == pytest.approx(0.11, abs=0.005)


def test_a_wrist_is_where_a_tracker_said_it_was() -> None:
    wrist = WristFilter()
    for _ in range(20):
        wrist.update(palm_at(0.0), ARM, 0.03)
    wrist.expect(np.array([0.06, 0.0, 0.5]))
    assert wrist.guess(palm_at(0.0)) == pytest.approx(0.06)
    assert wrist.update(palm_at(0.0), ARM, 0.07) == pytest.approx(0.065, abs=1e-3)


def test_a_wrist_that_jumps_is_believed_by_and_by() -> None:
    wrist = WristFilter()
    for _ in range(20):
        wrist.update(palm_at(0.0), ARM, 0.06)
    at_once = wrist.update(palm_at(0.0), ARM, 0.06 + 2 * SURPRISE * SEEN_SIGMA)
    assert 0.06 < at_once < 0.06 + 0.5 * SURPRISE * SEEN_SIGMA
    for _ in range(60):
        later = wrist.update(palm_at(0.0), ARM, 0.13)
    assert later == pytest.approx(0.13, abs=0.005)


def test_a_wrist_that_jumps_while_the_hand_shows_its_edge_is_something_else() -> None:
    wrist = WristFilter()
    for _ in range(5):
        wrist.update(palm_at(0.0, radius=0.02), ARM, 0.06)
    far = 0.06 + 2 * SURPRISE * SEEN_SIGMA
    assert wrist.update(palm_at(0.0, radius=0.02), ARM, far) == pytest.approx(0.06, abs=1e-3)
    assert 0.061 < wrist.update(palm_at(0.0, radius=0.02), ARM, 0.07) < 0.07


def slow_wrist(seen: np.ndarray, visible: int, guess: float) -> float:
    """What `likeliest_wrist` finds, in plain words."""
    found = []
    for j in range(1, visible - FEWEST_BEHIND):
        behind, before = seen[j : min(j + NEIGHBOURS, visible)], seen[max(j - NEIGHBOURS, 0) : j]
        threshold = NARROW * min(behind)
        comes_down = seen[j - 1] > threshold >= seen[j]
        if comes_down and max(behind) <= FLARE * min(behind) and max(before) >= BROAD * threshold:
            place = np.interp(threshold, [seen[j], seen[j - 1]], [BIN_MIDDLES[j], BIN_MIDDLES[j - 1]])
            breadth = min(max(before) / threshold, BROADEST)
            found.append((((place - guess) / SPREAD) ** 2 - BREADTH_WEIGHT * breadth, place))
    return float(min(found)[1]) if found else np.nan


@given(seed=st.integers(0, 2**32 - 1))
def test_the_likeliest_wrist_is_the_one_described(seed: int) -> None:
    rng = np.random.default_rng(seed)
    # A hand that comes down to a forearm, with noise that makes other places look like it.
    slope = np.clip((rng.uniform(0.03, 0.15) - BIN_MIDDLES) / 0.03, 0, 1)
    seen = 0.055 + rng.uniform(0, 0.04) * slope + rng.normal(0, 0.002, len(BIN_MIDDLES))
    visible, guess = int(rng.integers(0, len(seen) + 1)), float(rng.uniform(0.03, 0.13))
    np.testing.assert_allclose(likeliest_wrist(seen, visible, guess), slow_wrist(seen, visible, guess), rtol=1e-9)


def test_what_broadens_again_is_no_forearm() -> None:
    # Fingers, their narrow base, the palm, and the forearm.
    seen = np.interp(BIN_MIDDLES, [0, 0.03, 0.055, 0.09, 0.2], [0.08, 0.045, 0.085, 0.055, 0.065])
    assert likeliest_wrist(seen, len(seen), 0.04) == pytest.approx(0.085, abs=0.01)
    assert np.isnan(likeliest_wrist(np.full(50, 0.06), 50, 0.05))


@pytest.mark.parametrize("degrees", [-25, 0, 25])
def test_a_bent_wrist_is_cut_across_the_hand(degrees: float) -> None:
    bend = np.radians(degrees)
    c, s = np.cos(bend), np.sin(bend)
    hand = np.eye(4)
    hand[:3, 3] = [0, 0, 0.5]
    arm = np.array([[c, -s, 0, 0.0], [s, c, 0, 0.05], [0, 0, 1, 0.5], [0, 0, 0, 1.0]])
    placed = np.stack(
        [
            hand @ ellipsoid((0.0, 0.0, 0.0), (0.045, 0.055, 0.030)),
            hand @ ellipsoid((0.0, -0.07, 0.0), (0.012, 0.05, 0.012)),
            arm @ cone((0.0, -0.01, 0.0), 0.3, 0.030, 0.032),
        ]
    )
    depth = raycast(CAMERA, np.array([SPHERE, SPHERE, CYLINDER]), placed, np.arange(3)).depth.astype(np.float32)
    grid = Grid.over(depth, CAMERA, CAMERA.rect, (0.2, 0.95), 5)
    palm = min(find_palms(grid, grid), key=lambda palm: float(np.linalg.norm(palm.centre - [0, 0, 0.5])))
    forearm = find_arm(grid, palm, WRIST)
    assert forearm is not None
    across = hand_axis(grid, palm, forearm, WRIST)
    assert across.exits is forearm.exits
    # In the image; towards the camera it leans by as much as the palm is thicker than the wrist.
    lean, forearm_lean = (abs(np.arctan2(each.direction[0], each.direction[1])) for each in (across, forearm))
    assert lean < np.radians(6)
    if degrees != 0:
        assert lean < 0.6 * forearm_lean
    assert hand_axis(grid, replace(palm, radius=0.02), forearm, WRIST) is forearm


def test_noise_is_averaged() -> None:
    rng, wrist = np.random.default_rng(3), WristFilter()
    used = [wrist.update(palm_at(0.0), ARM, 0.06 + 0.008 * rng.normal()) for _ in range(200)]
    assert np.std(used[5:]) < 0.007
    assert np.mean(used) == pytest.approx(0.06, abs=0.002)
    assert GUESS_SIGMA > SEEN_SIGMA


def _slanted_palm(seed: int) -> tuple[Grid, Palm, Arm, np.ndarray]:
    """A random surface of which the palm reaches a part; a direction; and the reached points relative to the palm."""
    rng = np.random.default_rng(seed)
    depth = np.where(rng.random((48, 64)) < 0.2, 0, 0.5 + 0.01 * rng.random((48, 64))).astype(np.float32)
    grid = Grid.over(depth, Camera(64, 48, 100, 100, 31.5, 23.5), Rect(0, 0, 64, 48), (0.3, 0.9), 2)
    node = int(rng.choice(np.flatnonzero(grid.depth)))
    palm = Palm(node, grid.points[node], 0.04, 0.1, grid.paths([node], 0.12), ())
    direction = rng.normal(size=3) * [1, 1, 0.2]
    arm = Arm(direction / np.linalg.norm(direction), np.zeros(0, np.int64))
    return grid, palm, arm, grid.points[palm.paths.reached().ravel()] - palm.centre


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25)
def test_kernels_along_the_arm_equal_plain_geometry(seed: int) -> None:
    grid, palm, arm, offset = _slanted_palm(seed)
    along = offset @ arm.direction
    aside = np.linalg.norm(offset - along[:, None] * arm.direction, axis=1)
    near = np.abs(along - 0.03) < 0.01
    middle = section(grid, palm, arm, 0.03, 0.01)
    if near.any():
        assert middle is not None
        np.testing.assert_allclose(middle, palm.centre + offset[near & (aside < ARM_HALF_BREADTH)].mean(axis=0))
    else:
        assert middle is None

    total = np.zeros(len(BIN_MIDDLES) + 4 * MARGIN)
    areas = grid.areas.ravel()
    area_along(grid.points, areas, palm.paths.distance.ravel(), palm.centre, arm.direction, total)
    ends, middles = (-MARGIN * BIN, (len(BIN_MIDDLES) + MARGIN) * BIN), BIN * (np.arange(total.size) - 2 * MARGIN + 0.5)
    counts = (along > ends[0]) & (along < ends[1]) & (aside < ARM_HALF_BREADTH)
    # Each node's area falls off linearly with its distance from a bin's middle.
    shares = np.maximum(1 - np.abs(along[counts, None] - middles) / BIN, 0)
    np.testing.assert_allclose(total, areas[palm.paths.reached().ravel()][counts] @ shares, atol=1e-10)


def test_walking_back_stops_at_the_distance_asked_for() -> None:
    grid = Grid.over(
        np.full((48, 64), 0.5, np.float32), Camera(64, 48, 60, 60, 31.5, 23.5), Rect(0, 0, 64, 48), (0.3, 0.9), 4
    )
    paths = grid.paths([0], limit=3.0)
    nodes = np.arange(grid.depth.size)
    out = np.empty_like(nodes)
    walk_back(paths.distance, paths.parent, nodes, 0.1, out)
    for node, stop in zip(nodes, out, strict=True):
        way = paths.trace(int(node))
        expected = next(step for step in way if paths.distance.flat[step] <= 0.1)
        assert stop == expected


@pytest.mark.parametrize("radius", [1, 2, 3, 4, 5])
def test_square_and_diamond_make_a_disc(radius: int) -> None:
    mask = np.random.default_rng(radius).random((40, 50)) < 0.02
    np.testing.assert_array_equal(dilated(mask, radius), cv2.dilate(mask.astype(np.uint8), disc(radius)) > 0)
    np.testing.assert_array_equal(eroded(~mask, radius), cv2.erode((~mask).astype(np.uint8), disc(radius)) > 0)


@pytest.mark.parametrize("stride", [3, 5])
def test_shares_are_those_of_the_blocks_asked_for(stride: int) -> None:
    rng = np.random.default_rng(stride)
    mask = rng.integers(0, 2, (17, 23)).astype(np.uint8)
    blocks = rng.integers(0, 2, (-(-17 // stride), -(-23 // stride))).astype(np.uint8)
    share = np.zeros(blocks.shape, np.float32)
    share_of_blocks(mask, stride, blocks, share)
    step = 1 if stride < 4 else 2
    for i in range(blocks.shape[0]):
        for j in range(blocks.shape[1]):
            block = mask[i * stride : (i + 1) * stride : step, j * stride : (j + 1) * stride : step]
            assert share[i, j] == pytest.approx(block.mean() if blocks[i, j] else 0)

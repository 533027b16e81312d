"""Arm and wrist: breadth and direction of a tube seen at any slant, and the wrist's memory."""

import numpy as np
import pytest

from depthtrack.camera import Camera
from depthtrack.hand.primitives import CYLINDER, SPHERE, cone, ellipsoid
from depthtrack.observation.arm import BIN_MIDDLES, Arm, breadth, find_arm, walk_back
from depthtrack.observation.grid import Grid, Paths
from depthtrack.observation.palm import Palm, find_palms, palm_near, tips
from depthtrack.observation.view import share_of_blocks
from depthtrack.observation.window import Window
from depthtrack.observation.wrist import (
    GUESS_SIGMA,
    HAND_LENGTH,
    SEEN_SIGMA,
    SURPRISE,
    WRIST_TO_PALM,
    WristFilter,
    WristPlane,
    arm_nodes,
    find_wrist,
)
from depthtrack.rendering.raycast import raycast

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
    grid = Grid.over(depth, CAMERA, Window.whole(CAMERA), (0.2, 0.95), 5)
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
    wrist = find_wrist(grid, palm, arm)
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
    grid = Grid.over(depth, CAMERA, Window.whole(CAMERA), (0.2, 0.95), 5)
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


def test_a_wrist_that_jumps_is_something_else() -> None:
    wrist = WristFilter()
    for _ in range(5):
        wrist.update(palm_at(0.0), ARM, 0.06)
    far = 0.06 + 2 * SURPRISE * SEEN_SIGMA
    assert wrist.update(palm_at(0.0), ARM, far) == pytest.approx(0.06, abs=1e-3)
    assert wrist.update(palm_at(0.0), ARM, 0.07) == pytest.approx(0.066, abs=0.003)


def test_noise_is_averaged() -> None:
    rng, wrist = np.random.default_rng(3), WristFilter()
    used = [wrist.update(palm_at(0.0), ARM, 0.06 + 0.008 * rng.normal()) for _ in range(200)]
    assert np.std(used[5:]) < 0.007
    assert np.mean(used) == pytest.approx(0.06, abs=0.002)
    assert GUESS_SIGMA > SEEN_SIGMA


def test_walking_back_stops_at_the_distance_asked_for() -> None:
    grid = Grid.over(
        np.full((48, 64), 0.5, np.float32), Camera(64, 48, 60, 60, 31.5, 23.5), Window(0, 0, 64, 48), (0.3, 0.9), 4
    )
    paths = grid.paths([0], limit=3.0)
    nodes = np.arange(grid.depth.size)
    out = np.empty_like(nodes)
    walk_back(paths.distance, paths.parent, nodes, 0.1, out)
    for node, stop in zip(nodes, out, strict=True):
        way = paths.trace(int(node))
        expected = next(step for step in way if paths.distance.flat[step] <= 0.1)
        assert stop == expected


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

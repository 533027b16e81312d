"""The wrist: breadth and direction of a slanted tube, profiles of breadth, and bent wrists."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.hand.primitives import CYLINDER, SPHERE, cone, ellipsoid
from depthtrack.rendering.raycast import raycast
from depthtrack.segmentation.arm_breadth import bin_middles, breadth_profile
from depthtrack.segmentation.forearm import find_arm
from depthtrack.segmentation.hand_size import AVERAGE_HAND
from depthtrack.segmentation.options import ForearmOptions, WristOptions
from depthtrack.segmentation.wrist import WristPlane, arm_nodes, find_wrist, hand_axis, most_likely_wrist
from tests.support.arms import CAMERA, WRIST, club, nearest_palm

OPTIONS = WristOptions()
MIDDLES = bin_middles(OPTIONS.breadth)
TO_PALM = AVERAGE_HAND.wrist_to_palm


@pytest.mark.parametrize("degrees", [0, 30, 50])
def test_arm_and_wrist_of_a_slanted_tube(degrees: float) -> None:
    slant = np.radians(degrees)
    grid, palm = club(slant)
    assert palm.radius == pytest.approx(0.045 * (1 if degrees < 40 else np.cos(slant) ** 0.5), abs=0.008)
    arm = find_arm(grid, palm, WRIST, ForearmOptions())
    assert arm is not None
    axis = np.array([0.0, np.cos(slant), np.sin(slant)])
    assert arm.direction @ axis > np.cos(np.radians(12))
    profile = breadth_profile(grid, palm, arm, OPTIONS.breadth)
    tube = (MIDDLES > 0.07) & (MIDDLES < 0.15)
    # Nodes at the outline are lost, more of them on the farther part of the tube.
    np.testing.assert_allclose(profile[tube], 0.061, atol=0.013)
    assert np.ptp(profile[tube]) < 0.008
    wrist = find_wrist(grid, palm, arm, WRIST, OPTIONS)
    assert wrist is not None
    assert wrist == pytest.approx(0.04, abs=0.02)


def test_arm_nodes_are_those_beyond_the_plane() -> None:
    grid, palm = club(0.0)
    arm = find_arm(grid, palm, WRIST, ForearmOptions())
    assert arm is not None
    plane = WristPlane(palm.centre + WRIST * arm.direction, arm.direction)
    cut = arm_nodes(grid, palm, arm, plane)
    below = ((grid.points - plane.point) @ plane.normal > 0).reshape(grid.depth.shape) & (grid.depth > 0)
    np.testing.assert_array_equal(cut, below & palm.paths.reached())
    assert cut.sum() > 100


def kernel_wrist(profile: np.ndarray, visible: int, guess: float) -> float:
    """Return the wrist by the kernel with the default options."""
    return most_likely_wrist(
        profile,
        visible,
        guess,
        OPTIONS.breadth.bin_width,
        (OPTIONS.neighbours, OPTIONS.least_behind),
        (OPTIONS.narrow_ratio, OPTIONS.broad_ratio, OPTIONS.flare_ratio),
        (OPTIONS.place_scale, OPTIONS.breadth_weight, OPTIONS.broadest_ratio),
    )


def slow_wrist(profile: np.ndarray, visible: int, guess: float) -> float:
    """Return the wrist by the definition, bin by bin."""
    found = []
    for j in range(1, visible - OPTIONS.least_behind):
        behind, before = profile[j : min(j + OPTIONS.neighbours, visible)], profile[max(j - OPTIONS.neighbours, 0) : j]
        threshold = OPTIONS.narrow_ratio * min(behind)
        narrows = profile[j - 1] > threshold >= profile[j]
        if (
            narrows
            and max(behind) <= OPTIONS.flare_ratio * min(behind)
            and max(before) >= OPTIONS.broad_ratio * threshold
        ):
            place = np.interp(threshold, [profile[j], profile[j - 1]], [MIDDLES[j], MIDDLES[j - 1]])
            breadth = min(max(before) / threshold, OPTIONS.broadest_ratio)
            found.append((((place - guess) / OPTIONS.place_scale) ** 2 - OPTIONS.breadth_weight * breadth, place))
    return float(min(found)[1]) if found else np.nan


@given(seed=st.integers(0, 2**32 - 1))
def test_the_most_likely_wrist_equals_the_definition(seed: int) -> None:
    rng = np.random.default_rng(seed)
    # A hand narrows to a forearm; noise adds other candidates.
    slope = np.clip((rng.uniform(0.03, 0.15) - MIDDLES) / 0.03, 0, 1)
    profile = 0.055 + rng.uniform(0, 0.04) * slope + rng.normal(0, 0.002, len(MIDDLES))
    visible, guess = int(rng.integers(0, len(profile) + 1)), float(rng.uniform(0.03, 0.13))
    np.testing.assert_allclose(kernel_wrist(profile, visible, guess), slow_wrist(profile, visible, guess), rtol=1e-9)


def test_a_limb_that_broadens_again_is_no_forearm() -> None:
    # Fingers, their narrow base, the palm, and the forearm.
    profile = np.interp(MIDDLES, [0, 0.03, 0.055, 0.09, 0.2], [0.08, 0.045, 0.085, 0.055, 0.065])
    assert kernel_wrist(profile, len(profile), 0.04) == pytest.approx(0.085, abs=0.01)
    assert np.isnan(kernel_wrist(np.full(50, 0.06), 50, 0.05))


def test_a_hand_that_ends_within_the_visible_range_has_no_wrist() -> None:
    profile = np.where(MIDDLES < 0.06, 0.08, 0.0)
    assert np.isnan(kernel_wrist(profile, len(profile), 0.06))


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
    grid, palm = nearest_palm(depth)
    forearm = find_arm(grid, palm, WRIST, ForearmOptions())
    assert forearm is not None
    across = hand_axis(grid, palm, forearm, WRIST, TO_PALM, OPTIONS)
    assert across.exits is forearm.exits
    # The lean in the image; towards the camera, the palm is thicker than the wrist.
    lean, forearm_lean = (abs(np.arctan2(each.direction[0], each.direction[1])) for each in (across, forearm))
    assert lean < np.radians(6)
    if degrees != 0:
        assert lean < 0.6 * forearm_lean
    assert hand_axis(grid, replace(palm, radius=0.02), forearm, WRIST, TO_PALM, OPTIONS) is forearm

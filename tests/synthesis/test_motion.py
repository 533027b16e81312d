"""Motions: joint limits, self-collision, speeds and the validation of motion files."""

import contextlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from depthtrack.errors import InputError
from depthtrack.geometry.camera import PRESETS
from depthtrack.geometry.rotations import rotation_matrix
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import ANGLES, make_pose, tangent_between
from depthtrack.hand.primitives import Primitives
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.raycast import raycast
from depthtrack.synthesis.clearance import Clearance, closest_points_of_segments
from depthtrack.synthesis.motion import KeyframedMotion, load_motion
from depthtrack.synthesis.motion_file import find_motion, motion_names, read_table, shared_postures
from depthtrack.synthesis.random_motion import RandomMotion
from depthtrack.synthesis.scene_frame import mirrored, orientation
from depthtrack.synthesis.viewpoint import Viewpoint

NATURAL_OVERLAP = 0.004


def _sampled(name: str, rate: float = 30.0, seed: int = 0, seconds: float = 10.0) -> np.ndarray:
    motion = load_motion(name)
    count = round((seconds if motion.duration is None else motion.duration) * rate)
    return motion.poses(np.arange(count) / rate, seed)


def test_the_documented_motions_exist() -> None:
    assert {"everyday", "grasp", "signs", "fast", "random"} <= set(motion_names())


@pytest.mark.parametrize("name", motion_names())
def test_motions_respect_joint_limits_and_have_no_self_collision(name: str) -> None:
    poses = _sampled(name)
    assert np.all(poses[:, ANGLES] >= LOWER - 1e-9)
    assert np.all(poses[:, ANGLES] <= UPPER + 1e-9)
    assert Clearance(HandShape()).penetration(poses).max() < NATURAL_OVERLAP


@pytest.mark.parametrize("name", sorted(set(motion_names()) - {"fast"}))
def test_motions_have_natural_speeds_and_no_jumps(name: str) -> None:
    rate = 120.0
    step = tangent_between(*(lambda p: (p[:-1], p[1:]))(_sampled(name, rate))) * rate
    palm, turning, joints = (np.linalg.norm(step[:, :3], axis=1), np.linalg.norm(step[:, 3:6], axis=1), step[:, 6:])
    assert palm.max() < 0.6
    assert np.degrees(turning.max()) < 500
    assert np.degrees(np.abs(joints).max()) < 700
    # Between two samples, 1/120 s, a velocity changes by a small part of its range.
    assert np.abs(np.diff(palm)).max() < 0.1
    assert np.degrees(np.abs(np.diff(joints, axis=0)).max()) < 150


def test_everyday_has_360_frames_at_30_hertz_and_moves_every_joint() -> None:
    poses = _sampled("everyday")
    assert len(poses) == 360
    ranges = np.degrees(np.ptp(poses[:, ANGLES].reshape(360, 5, 4), axis=0))
    assert np.all(ranges[1:, 1:].min(axis=0) > [70, 80, 50])  # every finger bends fully at each joint
    up, facing = rotation_matrix(poses[:, 3:7])[:, :, 1], rotation_matrix(poses[:, 3:7])[:, 2, 2]
    assert np.degrees(np.ptp(np.arctan2(up[:, 0], -up[:, 1]))) > 40  # waves
    assert facing.min() < -0.99  # shows its palm
    assert facing.max() > 0.8  # and its back


def test_fast_is_the_path_of_everyday_at_three_times_the_speed() -> None:
    everyday, fast = load_motion("everyday"), load_motion("fast")
    times = np.linspace(0, 4, 120, endpoint=False)
    assert fast.duration == pytest.approx(4.0)
    np.testing.assert_allclose(fast.poses(times, 0), everyday.poses(3 * times, 0), atol=1e-12)


def test_signs_holds_more_than_twenty_distinct_postures() -> None:
    angles = np.degrees(_sampled("signs")[:, ANGLES])
    still = np.abs(np.diff(angles, axis=0)).max(axis=1) < 1e-6
    held: list[np.ndarray] = []
    for posture in angles[1:][still]:
        if all(np.abs(posture - other).max() > 15 for other in held):
            held.append(posture)
    assert len(held) > 20


def test_grasp_occludes_most_fingertips_in_most_frames() -> None:
    camera = PRESETS["kinect1"].resized(0.5)
    shape = HandShape()
    model, primitives = HandModel(shape), Primitives.of(shape)
    poses = Viewpoint(0, 0.5).transform_poses(_sampled("grasp", rate=5))
    occluded = []
    for pose in poses:
        surface = raycast(camera, primitives.kinds, primitives.transforms(model.transforms(pose)), primitives.bodies)
        tips = model.keypoints(pose)[8::4]
        u, v = np.rint(camera.project(tips)).astype(int).T
        # A fingertip is occluded if the visible surface is 1 cm or more in front of it.
        visible = surface.depth[v, u]
        occluded.append(np.mean((visible > 0) & (visible < tips[:, 2] - 0.01)))
    assert np.mean(np.array(occluded) >= 0.75) > 0.6


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**63 - 1))
def test_random_motion_is_natural_for_every_seed(seed: int) -> None:
    poses = _sampled("random", seed=seed, seconds=6)
    assert np.all((poses[:, ANGLES] >= LOWER - 1e-9) & (poses[:, ANGLES] <= UPPER + 1e-9))
    assert Clearance(HandShape()).penetration(poses).max() < NATURAL_OVERLAP
    assert np.all(np.abs(poses[:, :3]) <= [0.08, 0.06, 0.06])
    assert np.linalg.norm(np.diff(poses[:, :3], axis=0), axis=1).max() * 30 < 0.8


def test_random_motions_of_one_seed_have_a_common_prefix() -> None:
    motion = load_motion("random")
    long, short = np.arange(900) / 30, np.arange(200) / 30
    np.testing.assert_array_equal(motion.poses(long, 7)[:200], motion.poses(short, 7))
    assert np.abs(motion.poses(short, 7) - motion.poses(short, 8)).max() > 0.1


def test_turn_nod_and_tilt_rotate_the_palm_as_documented() -> None:
    palm, thumb, fingers = np.eye(3)[2], np.eye(3)[0], np.eye(3)[1]

    def pointing(axis: np.ndarray, tilt: float = 0, nod: float = 0, turn: float = 0) -> np.ndarray:
        return rotation_matrix(orientation(*np.radians([tilt, nod, turn]))) @ axis

    np.testing.assert_allclose(pointing(palm), [0, 0, -1], atol=1e-12)  # towards the camera
    np.testing.assert_allclose(pointing(fingers), [0, -1, 0], atol=1e-12)  # up
    np.testing.assert_allclose(pointing(thumb, turn=90), [0, 0, 1], atol=1e-12)  # away: the other edge shows
    np.testing.assert_allclose(pointing(palm, turn=180), [0, 0, 1], atol=1e-12)  # the back shows
    assert pointing(fingers, nod=30)[2] == pytest.approx(-0.5)  # towards the camera
    assert pointing(fingers, tilt=30)[0] == pytest.approx(0.5)  # to the right


def test_a_left_hand_mirrors_a_right_one() -> None:
    poses = _sampled("random", seed=3, seconds=2)
    right = HandModel(HandShape()).keypoints(poses)
    left = HandModel(HandShape(side="left")).keypoints(mirrored(poses))
    np.testing.assert_allclose(left, right * [-1, 1, 1], atol=1e-12)


def test_clearance_detects_self_collision() -> None:
    postures = shared_postures({}, "test")
    clearance = Clearance(HandShape())

    def overlap(angles: np.ndarray) -> float:
        return float(clearance.penetration(make_pose(np.zeros(3), [1, 0, 0, 0], angles)))

    crossed = postures["open"].copy()
    crossed[4], crossed[8] = np.radians([-10, 15])
    # Beyond all joint limits: fingertips pass through the palm.
    into_palm = postures["open"].copy()
    into_palm[8:12] = np.radians([0, 90, 150, 0])
    assert overlap(postures["open"]) == 0
    assert overlap(postures["fist"]) < NATURAL_OVERLAP
    assert overlap(crossed) > 0.005
    assert overlap(into_palm) > 0.01


@settings(max_examples=50)
@given(seed=st.integers(0, 2**32))
def test_distance_of_segments_matches_a_dense_sampling(seed: int) -> None:
    p0, p1, q0, q1 = np.random.default_rng(seed).normal(size=(4, 3))
    distance, s, t = closest_points_of_segments(p0, p1, q0, q1)
    shares = np.linspace(0, 1, 201)[:, None]
    between = np.linalg.norm((p0 + shares * (p1 - p0))[:, None] - (q0 + shares * (q1 - q0))[None], axis=-1)
    assert distance == pytest.approx(between.min(), abs=0.02)
    assert distance <= between.min() + 1e-9
    assert np.linalg.norm(p0 + s * (p1 - p0) - q0 - t * (q1 - q0)) == pytest.approx(float(distance))


def test_a_motion_file_is_interpolated_between_its_keys(tmp_path: Path) -> None:
    path = tmp_path / "nodding.toml"
    path.write_text(
        'about = "nods"\nelbow = [0, 300, 0]\n'
        "[postures.mine]\n"
        + "".join(f"{f} = [0, 10, 10, 5]\n" for f in ("thumb", "index", "middle", "ring", "little"))
        + '[[keys]]\nat = 0\nposture = "mine"\nposition = [0, 0, 0]\n'
        "[[keys]]\nat = 1.0\nindex = [0, 50, 60, 30]\n"
        "[[keys]]\nat = 2.0\nposition = [100, 0, -20]\n"
    )
    motion = load_motion(str(path))
    assert motion.duration == 2.0
    poses = motion.poses([0.0, 1.0, 1.5, 2.0], 0)
    np.testing.assert_allclose(np.degrees(poses[0, ANGLES]), [0, 10, 10, 5] * 5, atol=1e-9)
    np.testing.assert_allclose(np.degrees(poses[1:, 11:15]), [[0, 50, 60, 30]] * 3, atol=1e-9)  # constant after its key
    assert poses[1, 0] == pytest.approx(0.05)
    np.testing.assert_allclose(poses[3, :3], [0.1, 0, -0.02], atol=1e-12)


_GOOD_KEY = '{ at = 1, posture = "open" }'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('about = "x"\nkeys = [ { at = 1, posture = "opne" } ]', "posture 'opne'"),
        ('about = "x"\nkeys = [ { at = 1, posture = "open", positoin = [1, 2, 3] } ]', "unknown entry 'positoin'"),
        (f'about = "x"\nkeys = [ {_GOOD_KEY}, {_GOOD_KEY} ]', "in order of time"),
        ('about = "x"\nkeys = [ { at = 1, posture = "open", index = [0, 120, 0, 0] } ]', "within its range"),
        ('about = "x"\nkeys = [ { at = 1, posture = "open", position = [1, 2, nan] } ]', "3 numbers"),
        ('about = "x"\nkeys = [ { at = 99999, posture = "open" } ]', "from 0 to 3600"),
        ('about = "x"\nkeys = [ { at = 1, index = [0, 0, 0, 0] } ]', "thumb, middle, ring, little"),
        ('about = "x"\nkeys = [ { at = 0, posture = "open" } ]', "after 0 s"),
        ('about = "x"\nkeys = []', "a list of 1 to"),
        (f"keys = [ {_GOOD_KEY} ]", "about must be a line of text"),
        ('about = "x"\nlike = "random"\nspeed = 2', "unknown entry 'random'"),
        ('about = "x"\nlike = "everyday"\nspeed = 0', "speed must be a number from"),
        ('about = "x"\n[random]\npostures = ["nothing"]', "must be a list of some of"),
        ('about = "x"\n[postures.p]\nthumb = [0, 0, 0, 0]', "posture 'p' must give"),
        ('about = "x"\nkeys = [ { at = 1, posture = "open" }, { at = 1.0000001, tilt = 5 } ]', "1 ms apart"),
        (f'about = "x"\nkeys = [ {{ at = 1, posture = "open", tilt = {"9" * 400} }} ]', "at most 64 bits"),
        (f'about = "x"\nkeys = [ {{ at = 1, posture = "open", tilt = 0x{"f" * 9999} }} ]', "at most 64 bits"),
        (f"keys = {'9' * 9999}", "cannot read the motion file"),
        ('about = "x"\n[random]\npostures = [["open"]]', "must be a list of some of"),
        ('about = "x"\npostures = 3\nkeys = []', "must be a table"),
        ('about = "x"\nrandom = 3', "must be a table"),
        ("this is no TOML", "cannot read the motion file"),
        ("#" * 1_100_000, "at most 1,048,576 bytes"),
    ],
)
def test_invalid_motion_files_raise_an_input_error(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "motion.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        load_motion(str(path))


def test_the_error_for_an_unknown_motion_lists_the_known_ones() -> None:
    with pytest.raises(InputError, match="everyday, fast, grasp, other-grasps, random, signs"):
        load_motion("evryday")


_ODD = st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=3)) | st.recursive(
    st.integers(), lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=2)
)


@settings(max_examples=100, deadline=None)
@given(name=st.sampled_from(["grasp", "random"]), data=st.data())
def test_a_motion_file_with_any_entry_replaced_is_read_or_rejected(name: str, data: st.DataObject) -> None:
    table = read_table(find_motion(name))
    place: Any = table
    while True:
        keys = sorted(place) if isinstance(place, dict) else list(range(len(place)))
        key = data.draw(st.sampled_from(keys))
        if not isinstance(place[key], dict | list) or not place[key] or data.draw(st.booleans()):
            break
        place = place[key]
    place[key] = data.draw(_ODD)
    kind = RandomMotion if "random" in table else KeyframedMotion
    with contextlib.suppress(InputError):
        poses = kind.from_table(name, table, "here").poses(np.linspace(0, 2, 5), 0)
        assert np.all(np.isfinite(poses))


@settings(max_examples=30)
@given(
    values=st.lists(st.floats(0, 110), min_size=2, max_size=6),
    gaps=st.lists(st.floats(0.01, 2), min_size=6, max_size=6),
)
def test_interpolation_stays_within_the_range_of_its_keys(values: list[float], gaps: list[float]) -> None:
    times = np.cumsum([0, *gaps])[: len(values)]
    channels = {
        finger: (times, np.radians(np.outer(values, [0, 0, 1, 0])))
        for finger in ("thumb", "index", "middle", "ring", "little")
    }
    motion = KeyframedMotion("m", "m", times[-1], channels, np.zeros(3))
    bends = np.degrees(motion.poses(np.linspace(0, times[-1], 200), 0)[:, 13])
    assert min(values) - 1e-9 <= bends.min()
    assert bends.max() <= max(values) + 1e-9

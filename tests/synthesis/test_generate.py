"""Synthetic recordings: exact ground truth, reproducible bytes and all options."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.geometry.rotations import rotation_matrix
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import ORIENTATION
from depthtrack.hand.primitives import Primitives
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.recording.sequences.tum import TumSequence
from depthtrack.rendering.raycast import raycast
from depthtrack.rendering.triangles import rasterise
from depthtrack.synthesis.generate import Synthesiser, SyntheticFrame, write_recording
from tests.support.synthesis import synthesiser


def _bytes(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_the_same_options_give_the_same_bytes_for_any_number_of_threads(tmp_path: Path) -> None:
    options: dict[str, Any] = {"motion": "random", "sensor": "kinect1", "background": "room", "frames": 5, "seed": 4}
    for name, threads, seed in (("one", 1, 4), ("three", 3, 4), ("other", 1, 5)):
        write_recording(synthesiser(**options | {"seed": seed}), tmp_path / name, threads=threads)
    one, three, other = (_bytes(tmp_path / name) for name in ("one", "three", "other"))
    assert len(one) > 5 * 4
    assert one == three
    assert all(one[name] != other[name] for name in one if name.startswith(("depth/", "rgb/", "hand_poses")))


def test_any_frame_can_be_synthesised_alone() -> None:
    options: dict[str, Any] = {"sensor": "realsense", "background": "wall", "depth_noise": 0.002, "skin_flips": 0.05}
    in_order = list(synthesiser(**options, frames=4).frames(threads=2))
    alone = synthesiser(**options)[3]
    for name in ("depth", "colour", "mask", "skin", "exact_depth", "pose", "joints"):
        np.testing.assert_array_equal(getattr(in_order[3], name), getattr(alone, name))


@pytest.mark.parametrize("model", ["primitives", "skin"])
def test_ground_truth_is_that_of_the_hand_alone_except_for_occlusions(model: Any) -> None:
    made = synthesiser(model=model, background="room", seed=2)
    frame, camera, shape = made[300], made.sensor.camera, HandShape()
    transforms = HandModel(shape).transforms(frame.pose)
    if model == "primitives":
        hand = Primitives.of(shape)
        alone = raycast(camera, hand.kinds, hand.transforms(transforms), hand.bodies)
    else:
        skin = Skin.of(shape)
        vertices = skin.vertices(transforms)
        alone = rasterise(camera, vertices, skin.faces, skin.normals(vertices), skin.face_bodies)
    # The forearm occludes the part of the hand that the mask lacks.
    hidden = (alone.depth > 0) & ~frame.mask
    assert np.all(frame.exact_depth[hidden] < alone.depth[hidden])
    assert hidden.sum() < 0.1 * frame.mask.sum()
    # The mask adds the part of the forearm that covers the hand's end before the wrist.
    bare = frame.mask & (frame.exact_depth == alone.depth)
    assert bare.sum() > 0.9 * frame.mask.sum()
    beyond, _ = _beyond_wrist(made, frame)
    added = frame.mask & ~bare
    assert beyond[added].max() < 0
    assert beyond[added].min() > -0.02
    np.testing.assert_allclose(frame.joints, HandModel(shape).keypoints(frame.pose), atol=1e-12)
    np.testing.assert_array_equal(frame.depth, frame.exact_depth)


def _beyond_wrist(made: Synthesiser, frame: SyntheticFrame) -> tuple[Any, Any]:
    """Return distances (h, w) beyond the wrist's plane, metres, and the skin (h, w) near it."""
    v, u = np.mgrid[: made.sensor.camera.height, : made.sensor.camera.width]
    points = made.sensor.camera.unproject(np.stack([u, v], axis=-1), frame.exact_depth) - frame.joints[0]
    towards_fingers = rotation_matrix(frame.pose[ORIENTATION])[:, 1]
    return -points @ towards_fingers, frame.skin & (np.linalg.norm(points, axis=-1) < 0.05)


@pytest.mark.parametrize("model", ["primitives", "skin"])
@pytest.mark.parametrize("index", [0, 100, 258, 340])
def test_masks_of_all_hand_models_end_at_the_plane_of_the_wrist(model: Any, index: int) -> None:
    made = synthesiser(model=model, background="room", seed=2)
    frame = made[index]
    beyond, near = _beyond_wrist(made, frame)
    assert frame.mask[near & (beyond < 0)].all()
    # The skin model protrudes through the plane by a millimetre.
    assert not frame.mask[near & (beyond > 0.002)].any()


@pytest.mark.parametrize("model", ["primitives", "skin"])
def test_fingers_of_an_open_hand_project_into_its_mask(model: Any) -> None:
    made = synthesiser(model=model, background="wall")
    for index in (0, 30, 60):
        frame = made[index]
        near = cv2.dilate(frame.mask.astype(np.uint8), np.ones((7, 7), np.uint8))
        u, v = np.rint(made.sensor.camera.project(frame.joints[1:])).astype(int).T
        assert near[v, u].all()


def test_without_a_background_the_image_shows_the_hand_alone() -> None:
    frame = synthesiser()[0]
    np.testing.assert_array_equal(frame.depth > 0, frame.mask)
    np.testing.assert_array_equal(frame.skin, frame.mask)
    assert np.all(frame.colour[~frame.mask] == 0)
    assert np.all(frame.colour[frame.mask].max(axis=-1) > 30)


def test_a_left_hand_gives_the_mirror_image() -> None:
    right = synthesiser(forearm=True, motion="grasp")[50]
    left = synthesiser(forearm=True, motion="grasp", hand=HandShape(side="left"))[50]
    np.testing.assert_allclose(left.joints, right.joints * [-1, 1, 1], atol=1e-9)
    same = left.mask == right.mask[:, ::-1]
    assert np.sum(~same) <= 5  # pixels on an edge may show either surface
    both = same & left.mask
    apart = np.abs(left.exact_depth - right.exact_depth[:, ::-1])[both]
    assert np.quantile(apart, 0.9) < 1e-6
    # The mask ends with facets of the forearm, which are not mirrored.
    assert np.quantile(apart, 0.999) < 5e-4


def test_depth_noise_is_added_to_the_sensor_reading() -> None:
    clean, noisy = synthesiser()[40], synthesiser(depth_noise=0.01)[40]
    error = (noisy.depth - clean.depth)[clean.mask]
    assert error.std() == pytest.approx(0.01, rel=0.05)
    np.testing.assert_array_equal(clean.exact_depth, noisy.exact_depth)


@pytest.mark.parametrize("sensor", ["ideal", "kinect1", "kinect2", "realsense"])
def test_every_sensor_reads_the_hand_at_its_default_distance(sensor: Any) -> None:
    made = synthesiser(sensor=sensor, background="wall")
    for index in range(0, 360, 90):
        frame = made[index]
        assert np.mean(frame.depth[frame.mask] > 0) > 0.75
        error = np.abs(frame.depth - frame.exact_depth)[frame.mask & (frame.depth > 0)]
        assert np.median(error) < 0.002


@pytest.mark.parametrize("seed", [205, 206])
def test_the_hand_stays_within_the_range_of_the_sensor(seed: int) -> None:
    made = synthesiser(motion="random", sensor="kinect1", viewpoint=seed % 5, frames=180, seed=seed)
    assert made.distance > made.sensor.default_distance
    assert made.joints[..., 2].min() >= made.sensor.nearest


def test_a_stated_distance_is_kept() -> None:
    assert synthesiser(motion="random", sensor="kinect1", frames=180, seed=205, distance=0.5).distance == 0.5


def test_frames_and_rate_set_the_sampling_of_the_motion() -> None:
    assert len(synthesiser()) == 360
    assert len(synthesiser(rate=60)) == 720
    assert len(synthesiser(frames=7)) == 7
    assert len(synthesiser(motion="random")) == 360
    assert len(synthesiser(motion="random", frames=500)) == 500
    np.testing.assert_allclose(synthesiser(rate=60).poses[::2], synthesiser().poses, atol=1e-12)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"frames": 361}, "1 to 360 frames"),
        ({"frames": 0}, "1 to 360 frames"),
        ({"motion": "random", "frames": 10**9}, "1 to 108000 frames"),
        ({"distance": 5.0}, "between 0.2 and 3 m"),
        ({"distance": float("nan")}, "between 0.2 and 3 m"),
        ({"viewpoint": 8}, "0 to 7"),
        ({"background": "forest"}, "none, wall, room"),
        ({"model": "robot"}, "primitives, skin"),
        ({"depth_noise": -0.001}, "depth noise"),
        ({"skin_flips": 1.5}, "skin flips"),
        ({"rate": 0.0}, "frame rate"),
        ({"seed": -1}, "seed"),
    ],
)
def test_invalid_options_raise_an_input_error(options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        synthesiser(**options)


def test_the_command_writes_a_readable_recording_with_its_ground_truth(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "grasped"
    arguments = ["synth", "grasp", str(out), "--frames", "3", "--sensor", "kinect2", "--background", "room"]
    assert main([*arguments, "--side", "left", "--scale", "0.9", "--viewpoint", "2", "--seed", "8"]) == 0
    assert "depthtrack view" in capsys.readouterr().out
    sequence = TumSequence(out)
    truth = sequence.ground_truth
    assert truth is not None
    assert truth.poses is not None
    assert truth.joints is not None
    assert truth.hand == HandShape(side="left", scale=0.9)
    made = synthesiser(
        motion="grasp", sensor="kinect2", background="room", hand=truth.hand, viewpoint=2, seed=8, frames=3
    )  # fmt: skip
    for index, frame in enumerate(sequence):
        expected = made[index]
        np.testing.assert_allclose(frame.depth, expected.depth, atol=0.51 * sequence.camera.depth_scale)
        np.testing.assert_array_equal(sequence.hand_mask(index), expected.mask)
        exact = sequence.exact_depth(index)
        assert exact is not None
        np.testing.assert_allclose(exact[expected.mask], expected.exact_depth[expected.mask], atol=3e-5)
        assert frame.colour is not None
        assert np.abs(frame.colour.astype(int) - expected.colour).mean() < 4  # JPEG
        row = truth.at(frame.timestamp)
        assert row == index
        np.testing.assert_allclose(truth.poses[index], expected.pose, atol=1e-12)
        np.testing.assert_allclose(truth.joints[index], expected.joints, atol=1e-12)
    stored = json.loads((out / "sequence.json").read_text())
    assert (stored["motion"], stored["sensor"], stored["seed"], stored["distance"]) == ("grasp", "kinect2", 8, 0.65)
    assert stored["forearm"] is True
    assert main(["synth", "grasp", str(out), "--frames", "1"]) == 2
    assert "exists already" in capsys.readouterr().err
    assert main(["synth", "grasp", str(out), "--frames", "1", "--overwrite"]) == 0
    assert len(TumSequence(out)) == 1


def test_colours_of_flipped_pixels_are_stored_without_loss(tmp_path: Path) -> None:
    made = synthesiser(frames=1, skin_flips=0.1)
    write_recording(made, tmp_path / "flipped")
    sequence = TumSequence(tmp_path / "flipped")
    colour = sequence[0].colour
    assert colour is not None
    np.testing.assert_array_equal(colour, made[0].colour)

    np.testing.assert_array_equal(sequence.hand_mask(0), made[0].mask)


def test_the_command_reports_missing_and_unknown_arguments(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["synth", "list"]) == 0
    assert "everyday" in capsys.readouterr().out
    assert main(["synth", "everyday"]) == 2
    assert "expected a folder to write to" in capsys.readouterr().err
    assert main(["synth", "nonsense", str(tmp_path / "x")]) == 2
    assert "choose one of everyday" in capsys.readouterr().err
    assert not (tmp_path / "x").exists()

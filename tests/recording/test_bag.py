"""Bags of different makers: topics, units, cameras, and registered colour."""

import struct
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.recording import image_size, open_sequence
from depthtrack.recording.reading import ReadingOptions
from tests.geometry.test_registration import COLOUR, DEPTH, T_COLOUR_DEPTH, seen
from tests.support.bags import ORBBEC_PROFILE, Bag, compose, depth_png, depth_rvl
from tests.support.recordings import CAMERA, colour_at, depth_at, write_sample

TIMES = (10.0, 10.033, 10.066)
BROWN = (-0.28, 0.09, 0.001, -0.0007, -0.01)


def stored(depth: Any, unit: float = 0.001) -> Any:
    return np.rint(depth / unit).astype("<u2")


def quaternion(R: Any) -> tuple[float, float, float, float]:
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(R).as_quat()
    return x, y, z, w


def transform(types: Any, T: Any) -> Any:
    x, y, z, w = quaternion(T[:3, :3])
    return types["geometry_msgs/msg/Transform"](
        types["geometry_msgs/msg/Vector3"](*T[:3, 3]), types["geometry_msgs/msg/Quaternion"](x, y, z, w)
    )


def check_registered(path: Path) -> None:
    """Check that the scene of two cameras has the colours of its surfaces."""
    depth, expected = seen(DEPTH, np.eye(4))
    sequence = open_sequence(path)
    assert sequence.has_colour
    assert any("registered to the depth" in note for note in sequence.notes)
    frame = sequence[1]
    np.testing.assert_allclose(frame.depth, depth, rtol=0, atol=0.51e-3)
    assert frame.colour is not None
    edges = cv2.dilate(cv2.Canny(expected[..., 0], 50, 100), np.ones((5, 5), np.uint8)) > 0
    inside = np.asarray(frame.colour.any(axis=-1)) & ~edges
    assert inside.mean() > 0.6
    assert (np.abs(frame.colour.astype(int) - expected).max(axis=-1) < 12)[inside].mean() > 0.999


def two_cameras(depth_topic: str, colour_topic: str, encoding: str, unit: float) -> Bag:
    """Return a bag with depth and colour of two cameras, without their description."""
    bag = Bag()
    depth, _ = seen(DEPTH, np.eye(4))
    _, colour = seen(COLOUR, T_COLOUR_DEPTH)
    for time in TIMES:
        bag.image(depth_topic, time, stored(depth, unit), encoding, frame="depth_optical")
        bag.image(colour_topic, time + 0.004, colour, "rgb8", frame="color_optical")
    return bag


def test_ros_cameras_are_joined_by_static_transforms(tmp_path: Path) -> None:
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS2_HUMBLE).types
    bag = two_cameras("/cam/depth/image_rect_raw", "/cam/color/image_raw", "16UC1", 0.001)
    bag.info("/cam/depth/camera_info", DEPTH, frame="depth_optical")
    bag.info("/cam/color/camera_info", COLOUR, frame="color_optical")
    header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](0, 0), "link")
    T_link_depth = np.eye(4)
    T_link_depth[:3, 3] = 0.1, 0.2, 0.3
    for frame, T in (("depth_optical", T_link_depth), ("color_optical", T_link_depth @ np.linalg.inv(T_COLOUR_DEPTH))):
        stamped = types["geometry_msgs/msg/TransformStamped"](header, frame, transform(types, T))
        bag.add("/tf_static", 0, "tf2_msgs/msg/TFMessage", transforms=[stamped])
    check_registered(bag.write(tmp_path / "film.db3"))
    check_registered(bag.write(tmp_path / "film.mcap"))


def test_realsense_bags_of_ros_1(tmp_path: Path) -> None:
    """The layout of ros_file_format.h: an option for the unit, transforms from a reference."""
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS1_NOETIC).types
    depth, colour = "/device_0/sensor_0/Depth_0", "/device_0/sensor_1/Color_0"
    bag = two_cameras(f"{depth}/image/data", f"{colour}/image/data", "mono16", 0.0001)
    bag.info(f"{depth}/info/camera_info", DEPTH, frame="")
    bag.info(f"{colour}/info/camera_info", COLOUR, frame="")
    bag.add("/device_0/sensor_0/option/Depth Units/value", 0, "std_msgs/msg/Float32", data=0.0001)
    T_depth_reference = np.eye(4)
    T_depth_reference[:3, 3] = 0.01, 0.02, 0.03
    for stream, T in ((depth, T_depth_reference), (colour, T_COLOUR_DEPTH @ T_depth_reference)):
        message = transform(types, T)
        kind = "geometry_msgs/msg/Transform"
        bag.add(f"{stream}/tf/0", 0, kind, translation=message.translation, rotation=message.rotation)
    infrared = np.full((48, 64), 9, np.uint8)
    bag.image("/device_0/sensor_0/Infrared_1/image/data", TIMES[0], infrared, "8UC1")
    path = bag.write(tmp_path / "film.bag")
    assert open_sequence(path).camera == Camera(**{**vars(DEPTH), "depth_scale": 0.0001})
    check_registered(path)


def test_orbbec_bags(tmp_path: Path) -> None:
    bag = two_cameras("/cam/sensor_3/frameType_3", "/cam/sensor_2/frameType_2", "Y16", 0.001)
    bag.image("/cam/sensor_1/frameType_1", TIMES[0], np.zeros((48, 64), "<u2"), "mono16")
    for stream, camera in ((3, DEPTH), (2, COLOUR)):
        bag.add(
            f"/cam/streamProfileType_{stream}",
            0,
            ORBBEC_PROFILE,
            frame_id="",
            streamType=stream,
            format=0,
            distortionModel=0,
            cameraIntrinsic=np.array([camera.fx, camera.fy, camera.cx, camera.cy], np.float32),
            cameraDistortion=np.zeros(8, np.float32),
            width=camera.width,
            height=camera.height,
            fps=30.0,
            rotationMatrix=T_COLOUR_DEPTH[:3, :3].ravel().astype(np.float32),
            translationMatrix=(1000 * T_COLOUR_DEPTH[:3, 3]).astype(np.float32),
        )
    check_registered(bag.write(tmp_path / "film.bag"))


def test_compressed_depth_and_colour(tmp_path: Path) -> None:
    bag = Bag()
    for index, time in enumerate(TIMES):
        jpeg = cv2.imencode(".jpg", colour_at(index)[..., ::-1], (cv2.IMWRITE_JPEG_QUALITY, 100))[1].tobytes()
        png = depth_png(stored(depth_at(index)))
        bag.compressed("/c/depth/image_raw/compressedDepth", time, png, "16UC1; compressedDepth png")
        bag.compressed("/c/color/image_raw/compressed", time, jpeg, "rgb8; jpeg compressed bgr8")
        bag.info("/c/depth/camera_info", CAMERA, time=time)
        bag.info("/c/color/camera_info", CAMERA, time=time)
    sequence = open_sequence(bag.write(tmp_path / "film.mcap"))
    for index, frame in enumerate(sequence):
        np.testing.assert_allclose(frame.depth, depth_at(index), rtol=0, atol=0.51e-3)
        assert frame.colour is not None
        assert np.abs(frame.colour.astype(int) - colour_at(index)).mean() < 4
    assert sequence.notes == []


def test_depth_in_metres_keeps_its_precision_and_loses_what_is_not_finite(tmp_path: Path) -> None:
    bag = Bag()
    depth = depth_at(0)
    depth[0, :3] = np.nan, np.inf, -1
    bag.image("/depth", TIMES[0], depth.astype("<f4"), "32FC1")
    bag.info("/camera_info", CAMERA)
    (frame,) = open_sequence(bag.write(tmp_path / "film.mcap"))
    np.testing.assert_array_equal(frame.depth[0, :3], 0)
    np.testing.assert_array_equal(frame.depth[1:], depth_at(0)[1:])
    assert frame.camera.depth_scale == 0.0002


def test_compressed_depth_in_metres_is_quantised_inverse_depth(tmp_path: Path) -> None:
    """The formula of image_transport_plugins, with its usual parameters."""
    a, b = 100.0 * (100.0 + 1), 1 - 100.0 * (100.0 + 1) / 10.0
    quantised = np.rint(a / depth_at(0).clip(0.1) + b).astype(np.uint16)
    quantised[depth_at(0) == 0] = 0
    png = struct.pack("<iff", 0, a, b) + depth_png(quantised)[12:]
    bag = Bag()
    bag.compressed("/depth/compressedDepth", TIMES[0], png, "32FC1; compressedDepth png")
    bag.info("/camera_info", CAMERA)
    (frame,) = open_sequence(bag.write(tmp_path / "film.mcap"))
    np.testing.assert_allclose(frame.depth, depth_at(0), rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("suffix", [".bag", ".db3", ".mcap"])
def test_depth_compressed_by_rvl(tmp_path: Path, suffix: str) -> None:
    bag = Bag()
    for index, time in enumerate(TIMES):
        data = depth_rvl(stored(depth_at(index)))
        bag.compressed("/c/depth/image_raw/compressedDepth", time, data, "16UC1; compressedDepth rvl")
        bag.info("/c/depth/camera_info", CAMERA, time=time)
    sequence = open_sequence(bag.write(tmp_path / f"film{suffix}"))
    assert len(sequence) == len(TIMES)
    for index, frame in enumerate(sequence):
        np.testing.assert_array_equal(frame.depth, stored(depth_at(index)) * np.float32(0.001))


@pytest.mark.parametrize("kept", [3, 16, 21, 300])
def test_damaged_rvl_is_a_damaged_frame(tmp_path: Path, kept: int) -> None:
    whole = depth_rvl(stored(depth_at(0)))
    bag = Bag()
    for index, time in enumerate(TIMES):
        data = whole[:kept] if index == 1 else whole
        bag.compressed("/depth/compressedDepth", time, data, "16UC1; compressedDepth rvl")
    bag.info("/camera_info", CAMERA)
    sequence = open_sequence(bag.write(tmp_path / "film.mcap"), on_damage="skip")
    assert len(list(sequence)) == len(TIMES) - 1
    assert "RVL" in sequence.damaged[0].reason


def test_a_folder_of_images_with_a_bag_in_it_is_a_folder_of_images(tmp_path: Path) -> None:
    folder = write_sample(tmp_path / "sample")
    compose(depth_at, None, CAMERA, TIMES).write(folder / "film.db3")
    assert len(open_sequence(folder)) == 5


def test_distortion_is_removed_and_noted(tmp_path: Path) -> None:
    bag = Bag()
    bag.image("/depth/image_raw", TIMES[0], stored(np.full(CAMERA.shape, 0.7)), "16UC1")
    bag.info("/depth/camera_info", CAMERA, BROWN)
    path = bag.write(tmp_path / "film.mcap")
    sequence = open_sequence(path)
    assert any("distortion of up to" in note for note in sequence.notes)
    np.testing.assert_allclose(sequence[0].depth[8:16, 8:24], 0.7, atol=1e-6)
    # A camera that the user gives is taken as it is.
    assert open_sequence(path, CAMERA).notes == []


def test_colour_of_an_unknown_camera_is_noted_and_not_used(tmp_path: Path) -> None:
    bag = two_cameras("/cam/depth/image_raw", "/cam/color/image_raw", "16UC1", 0.001)
    bag.info("/cam/depth/camera_info", DEPTH, frame="depth_optical")
    bag.info("/cam/color/camera_info", COLOUR, frame="color_optical")
    sequence = open_sequence(bag.write(tmp_path / "film.mcap"))
    assert not sequence.has_colour
    assert sequence[0].colour is None
    assert any("not used" in note and "transform" in note for note in sequence.notes)


def test_the_user_chooses_among_topics(tmp_path: Path) -> None:
    bag = compose(depth_at, colour_at, CAMERA, TIMES)
    for time in TIMES:
        bag.image("/camera/aligned_depth_to_color/image_raw", time, stored(np.full(CAMERA.shape, 0.4)), "16UC1")
        bag.info("/camera/aligned_depth_to_color/camera_info", CAMERA, time=time)
    path = bag.write(tmp_path / "film.mcap")
    sequence = open_sequence(path)
    assert sequence[0].depth.max() == pytest.approx(0.4)
    assert any("--depth-topic chooses another: /camera/depth/image_raw" in note for note in sequence.notes)
    chosen = open_sequence(path, reading=ReadingOptions(depth_topic="/camera/depth/image_raw"))
    np.testing.assert_allclose(chosen[0].depth, depth_at(0), rtol=0, atol=0.51e-3)
    with pytest.raises(InputError, match="--depth-topic must be a topic with images"):
        open_sequence(path, reading=ReadingOptions(depth_topic="/nothing"))
    with pytest.raises(InputError, match=r"rgb8.*cannot be used"):
        open_sequence(path, reading=ReadingOptions(depth_topic="/camera/color/image_raw"))


def test_depth_as_a_picture_is_rejected(tmp_path: Path) -> None:
    bag = Bag()
    bag.image("/camera/depth/image_raw", TIMES[0], colour_at(0), "rgb8")
    with pytest.raises(InputError, match="turned into a picture"):
        open_sequence(bag.write(tmp_path / "film.mcap"))


def test_a_bag_without_a_camera_needs_one(tmp_path: Path) -> None:
    bag = Bag()
    bag.image("/depth", TIMES[0], stored(depth_at(0)), "16UC1")
    path = bag.write(tmp_path / "film.mcap")
    with pytest.raises(InputError, match="describes no camera"):
        open_sequence(path)
    assert image_size(path) == (CAMERA.width, CAMERA.height)
    scaled = Camera(**{**vars(CAMERA), "depth_scale": 0.0005})
    np.testing.assert_allclose(open_sequence(path, scaled)[0].depth, depth_at(0) / 2, rtol=0, atol=0.51e-3)


def test_images_with_the_time_of_another_are_left_out(tmp_path: Path) -> None:
    bag = compose(depth_at, None, CAMERA, (1.0, 1.1, 1.1, 1.2))
    sequence = open_sequence(bag.write(tmp_path / "film.mcap"))
    assert sequence.timestamps.tolist() == [1.0, 1.1, 1.2]
    assert any("1 images" in note for note in sequence.notes)


def test_the_files_of_the_realsense_sdk(tmp_path: Path) -> None:
    """A software device of the SDK records depth and colour of two cameras."""
    pytest.importorskip("pyrealsense2", exc_type=ImportError)
    from tests.support.realsense import record

    path = tmp_path / "film.db3"
    depth, _ = seen(DEPTH, np.eye(4))
    _, colour = seen(COLOUR, T_COLOUR_DEPTH)
    record(path, DEPTH, COLOUR, T_COLOUR_DEPTH, [stored(depth, 0.0001)] * 6, [colour] * 6, 0.0001)
    sequence = open_sequence(path)
    assert sequence.camera.depth_scale == 0.0001
    np.testing.assert_allclose(sequence.timestamps, np.arange(6) / 30, atol=1e-6)
    check_registered(path)


@pytest.mark.parametrize("kind", ["camera", "another clock", "one missing", "not increasing", "no number"])
def test_times_are_those_of_the_realsense_camera_if_all_images_have_them(tmp_path: Path, kind: str) -> None:
    received, bag = (0.0, 0.021, 0.06, 0.071), Bag()
    for index, time in enumerate(received):
        for stream, image in (("Depth", stored(depth_at(index))), ("Color", colour_at(index))):
            topic = f"/device_0/sensor_0/{stream}_0"
            bag.image(f"{topic}/image/data", time, image, "16UC1" if stream == "Depth" else "rgb8")
            bag.info(f"{topic}/image/camera_info", CAMERA, time=time)
            clock = "System Time" if kind == "another clock" and stream == "Color" else "Hardware Clock"
            stamp = "5" if kind == "not increasing" else "late" if kind == "no number" else f"{1e5 + index * 33.25:.6f}"
            if kind != "one missing" or index != 2:
                text = f"Frame number={index};timestamp_domain={clock};timestamp={stamp};Actual Fps=30;"
                bag.add(f"{topic}/image/metadata", time, "std_msgs/msg/String", data=text)
    sequence = open_sequence(bag.write(tmp_path / "film.db3"))
    expected = 100 + np.arange(4) * 0.03325 if kind == "camera" else received
    np.testing.assert_allclose(
        sequence.timestamps - sequence.timestamps[0], np.subtract(expected, expected[0]), atol=1e-9
    )
    assert (sequence.timestamps[0] > 99) == (kind == "camera")

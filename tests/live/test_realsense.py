"""The RealSense source: a file of the software device of pyrealsense2, and a stand-in."""

import sys
import time
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from depthtrack.errors import InputError, MissingExtraError
from depthtrack.live.frames import LiveFrame
from depthtrack.live.realsense import RealSenseSource

needs_realsense = pytest.mark.skipif(find_spec("pyrealsense2") is None, reason="pyrealsense2 is not installed")
WIDTH, HEIGHT, FRAMES = 64, 48, 8


def record(path: Path) -> None:
    """Record frames whose depth is 500 units and their number, by the software device."""
    import pyrealsense2 as rs

    device, intrinsics = rs.software_device(), rs.intrinsics()
    intrinsics.width, intrinsics.height = WIDTH, HEIGHT
    intrinsics.fx, intrinsics.fy, intrinsics.ppx, intrinsics.ppy = 60.0, 61.0, 31.0, 23.0
    intrinsics.model, intrinsics.coeffs = rs.distortion.none, [0.0] * 5
    sensors, profiles = [], []
    for name, kind, form, size in (
        ("Depth", rs.stream.depth, rs.format.z16, 2),
        ("Color", rs.stream.color, rs.format.rgb8, 3),
    ):
        stream = rs.video_stream()
        stream.type, stream.fmt, stream.bpp, stream.uid, stream.index = kind, form, size, size, 0
        stream.width, stream.height, stream.fps, stream.intrinsics = WIDTH, HEIGHT, 30, intrinsics
        sensors.append(device.add_sensor(name))
        profiles.append(sensors[-1].add_video_stream(stream))
    sensors[0].add_read_only_option(rs.option.depth_units, 0.0005)
    same = rs.extrinsics()
    same.rotation, same.translation = np.eye(3).ravel().tolist(), [0.0] * 3
    profiles[0].register_extrinsics_to(profiles[1], same)
    recorder = rs.recorder(str(path), device)
    recorded = recorder.query_sensors()
    for sensor, profile in zip(recorded, profiles, strict=True):
        sensor.open(profile)
        sensor.start(lambda frame: None)
    for number in range(FRAMES):
        images = (np.full((HEIGHT, WIDTH), 500 + number, np.uint16), np.full((HEIGHT, WIDTH, 3), number, np.uint8))
        for sensor, profile, image, size in zip(sensors, profiles, images, (2, 3), strict=True):
            frame = rs.software_video_frame()
            frame.pixels, frame.stride, frame.bpp = image, WIDTH * size, size
            frame.timestamp, frame.domain = 1000 + 100 * number, rs.timestamp_domain.hardware_clock
            frame.frame_number, frame.profile = number + 1, profile.as_video_stream_profile()
            if size == 2:
                frame.depth_units = 0.0005
            sensor.on_video_frame(frame)
        time.sleep(0.05)  # a file plays at the pace at which it was recorded
    for sensor in recorded:
        sensor.stop()
        sensor.close()


@needs_realsense
def test_a_recorded_file_plays_as_a_camera(tmp_path: Path) -> None:
    record(tmp_path / "a.db3")
    with RealSenseSource(file=tmp_path / "a.db3") as source:
        camera = source.camera
        frames = list(source)
    assert (camera.width, camera.height, camera.fx, camera.cy) == (WIDTH, HEIGHT, 60.0, 23.0)
    assert camera.depth_scale == pytest.approx(0.0005)
    assert len(frames) > FRAMES // 2  # a busy machine drops some
    numbers = [frame.number for frame in frames]
    assert numbers == sorted(set(numbers))
    for frame in frames:
        assert frame.timestamp == pytest.approx(1 + 0.1 * (frame.number - 1))
        assert set(np.unique(frame.depth)) == {499 + frame.number}
        assert frame.colour is not None
        assert abs(int(frame.colour[0, 0, 0]) - (frame.number - 1)) <= 1  # the driver pairs images


@needs_realsense
def test_a_missing_camera_is_reported_in_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="RealSense camera"):
        RealSenseSource(serial="000000000000")
    (tmp_path / "a.bag").write_bytes(b"no bag")
    with pytest.raises(InputError, match=r"a\.bag.*is it a recording"):
        RealSenseSource(file=tmp_path / "a.bag")


def test_without_the_library_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyrealsense2", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'depthtrack\[realsense\]'"):
        RealSenseSource()


class StandIn:
    """Stands for pyrealsense2 with a camera.

    framesets: number of the depth image, and whether there is a colour image.
    """

    def __init__(self, framesets: list[tuple[int, bool]]) -> None:
        self.framesets, self.enabled, self.stopped = iter(framesets), list[Any](), False
        self.stream = SimpleNamespace(depth="depth", color="color")
        self.format = SimpleNamespace(z16="z16", rgb8="rgb8")
        self.camera_info = SimpleNamespace(name="name", serial_number="serial")
        intrinsics = SimpleNamespace(width=4, height=2, fx=3.0, fy=3.0, ppx=1.5, ppy=0.5)
        profile = SimpleNamespace(get_intrinsics=lambda: intrinsics)
        device = SimpleNamespace(
            get_info=lambda field: {"name": "D435", "serial": "123"}[field],
            supports=lambda _: True,
            first_depth_sensor=lambda: SimpleNamespace(get_depth_scale=lambda: 0.001),
        )
        self.context = lambda: SimpleNamespace(query_devices=lambda: [device])
        streams = [SimpleNamespace(stream_type=lambda: "depth"), SimpleNamespace(stream_type=lambda: "color")]
        self.started = SimpleNamespace(
            get_device=lambda: device,
            get_streams=lambda: streams,
            get_stream=lambda _: SimpleNamespace(as_video_stream_profile=lambda: profile),
        )

    def pipeline(self) -> Any:
        return SimpleNamespace(
            start=lambda config: self.started,
            try_wait_for_frames=lambda timeout: self.next(),
            stop=lambda: setattr(self, "stopped", True),
        )

    def config(self) -> Any:
        return SimpleNamespace(
            enable_device=self.enabled.append, enable_stream=lambda *stream: self.enabled.append(stream)
        )

    def align(self, stream: str) -> Any:
        return SimpleNamespace(process=lambda frames: frames)

    def next(self) -> tuple[bool, Any]:
        number, coloured = next(self.framesets, (0, False))
        depth = SimpleNamespace(
            get_frame_number=lambda: number, get_timestamp=lambda: 100.0 * number, get_data=lambda: np.ones((2, 4))
        )
        colour = SimpleNamespace(get_data=lambda: np.zeros((2, 4, 3), np.uint8)) if coloured else None
        frames = SimpleNamespace(get_depth_frame=lambda: depth, get_color_frame=lambda: colour)
        return number > 0, frames


def test_repeated_images_are_left_out_and_a_silent_camera_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    camera = StandIn([(1, False), (1, True), (1, True), (4, True), (3, True), (5, True)])
    monkeypatch.setitem(sys.modules, "pyrealsense2", camera)
    frames: list[LiveFrame] = []
    with RealSenseSource("123", (4, 2), 15, clock=lambda: 9.0) as source:
        assert (source.name, source.camera.width) == ("D435", 4)
        with pytest.raises(InputError, match="D435 must deliver frames, found none in 5 s"):
            frames.extend(source)
    numbers = [(frame.number, frame.timestamp, frame.arrival) for frame in frames]
    assert numbers == [(1, 0.1, 9.0), (4, 0.4, 9.0), (5, 0.5, 9.0)]
    assert camera.enabled == ["123", ("depth", 4, 2, "z16", 15), ("color", 4, 2, "rgb8", 15)]
    assert camera.stopped
    with pytest.raises(InputError, match="no RealSense camera has the serial number 9: choose one of 123"):
        RealSenseSource("9")

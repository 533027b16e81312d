"""Bags of ROS 1 (`.bag`) and ROS 2 (`.db3`, `.mcap`, folders), of RealSense and of Orbbec."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.distortion import Undistortion
from depthtrack.geometry.registration import Registration
from depthtrack.recording.bags.cameras import (
    FLOAT_STEP,
    MILLIMETRE,
    BagCamera,
    camera_of,
    depth_unit,
    transform_between,
)
from depthtrack.recording.bags.images import colour_of, depth_of, encoding_of, size_of_image
from depthtrack.recording.bags.messages import Messages
from depthtrack.recording.bags.opening import is_bag, open_storage
from depthtrack.recording.bags.realsense import camera_stamps
from depthtrack.recording.bags.topics import choose_topics
from depthtrack.recording.colour_association import associate_colour
from depthtrack.recording.reading import ReadingOptions
from depthtrack.recording.sequences.base import BaseSequence
from depthtrack.recording.sequences.tum_lists import MAX_FRAMES
from depthtrack.types import Array, Depth, Image, Index


class BagSequence(BaseSequence):
    """A bag with depth images and perhaps colour, which is registered to the depth."""

    format_name = "a bag (.bag, .db3, .mcap)"

    def _open(self, camera: Camera | None) -> None:
        """See `BaseSequence`.

        Raises:
            InputError: if there is no depth, or the bag describes no camera and none is given.
            MissingExtraError: if the library rosbags is not installed.
        """
        self._messages = Messages(open_storage(self.path))
        self._choice = choose_topics(self._messages, self.reading)
        chosen = [topic for topic in (self._choice.depth, self._choice.colour) if topic is not None]
        self._camera_stamps = camera_stamps(self._messages, chosen)
        self._depth_rows, self.timestamps = self._times(self._choice.depth)
        if self._messages.storage.cut is not None:
            self.notes.append(
                f"{self.path.name} is cut short ({self._messages.storage.cut}):"
                f" the {len(self.timestamps)} frames before it are read"
            )
        if self._choice.others:
            self.notes.append(
                f"depth is that of {self._choice.depth};"
                f" --depth-topic chooses another: {', '.join(self._choice.others)}"
            )
        self._open_depth(camera)
        self._last: tuple[int, Depth] | None = None
        self._partner: dict[int, int] = {}
        self._colour_rows: Index = np.zeros(0, dtype=np.int64)
        self._registration: Registration | None = None
        self._colour_undistortion: Undistortion | None = None
        self._open_colour()
        self.has_colour = bool(self._partner)

    @classmethod
    def matches(cls, path: Path) -> bool:
        """See `BaseSequence`."""
        return is_bag(path)

    @classmethod
    def image_size(cls, path: Path, reading: ReadingOptions | None = None) -> tuple[int, int]:
        """See `BaseSequence`."""
        storage = open_storage(path)
        try:
            messages = Messages(storage)
            topic = choose_topics(messages, reading or ReadingOptions()).depth
            return size_of_image(messages.first(topic), f"{path}: {topic}")
        finally:
            storage.close()

    def read_depth(self, index: int) -> Depth:
        """See `BaseSequence`."""
        # Colour is registered with the depth that was read just before.
        if self._last is not None and self._last[0] == index:
            return self._last[1]
        topic = self._choice.depth
        message = self._messages.decode(topic, int(self._depth_rows[index]))
        depth = depth_of(message, self._unit, self.camera.shape, f"{self.path}: frame {index} of {topic}")
        if self._undistortion is not None:
            depth = self._undistortion.depth(depth)
        self._last = (index, depth)
        return depth

    def read_colour(self, index: int) -> Image | None:
        """See `BaseSequence`."""
        if self._choice.colour is None or index not in self._partner:
            return None
        topic = self._choice.colour
        message = self._messages.decode(topic, int(self._colour_rows[self._partner[index]]))
        where = f"{self.path}: image {self._partner[index]} of {topic}"
        if self._registration is not None:
            return self._registration(
                self.read_depth(index), colour_of(message, self._registration.colour.shape, where)
            )
        colour = colour_of(message, self.camera.shape, where)
        return colour if self._colour_undistortion is None else self._colour_undistortion.colour(colour)

    def _times(self, topic: str) -> tuple[Index, Array]:
        """Return the messages of a topic in order of time, and their times, seconds.

        Of messages with equal times, the first is taken.
        """
        stamps = self._camera_stamps.get(topic)
        if stamps is None:
            stamps = self._messages.stamps(topic)
        rows = np.argsort(stamps, kind="stable")
        rows = rows[np.concatenate([[True], np.diff(stamps[rows]) > 0])]
        if len(rows) < len(stamps):
            self.notes.append(
                f"{len(stamps) - len(rows)} images of {topic} have the time of another one and are left out"
            )
        if len(rows) > MAX_FRAMES:
            raise InputError(f"{self.path}: {topic} must have at most {MAX_FRAMES:,} images: split the recording")
        return rows, stamps[rows] / 1e9

    def _open_depth(self, given: Camera | None) -> None:
        """Find camera, unit and distortion of the depth."""
        messages, topic = self._messages, self._choice.depth
        first = messages.first(topic)
        size = size_of_image(first, f"{self.path}: {topic}")
        self._own = None if given is not None else camera_of(messages, topic, size)
        is_float = encoding_of(first) == "32fc1"
        stated = self.reading.depth_scale or depth_unit(messages, topic)
        self._unit = stated if given is None else given.depth_scale
        if given is not None:
            self._own = BagCamera(given, None, "")
        if self._own is None:
            raise InputError(
                f"{self.path} describes no camera of {topic}:"
                " give it with --camera FILE.json, --camera-preset NAME, or --fx and --depth-scale"
            )
        scale = FLOAT_STEP if is_float and given is None and stated == MILLIMETRE else self._unit
        self.camera = replace(self._own.camera, depth_scale=scale)
        self._undistortion = Undistortion.needed(self.camera, self._own.distortion)
        if self._undistortion is not None:
            self.notes.append(self._undistortion.note)

    def _open_colour(self) -> None:
        """Pair colour with depth and register it, or note why depth is read alone."""
        topic, reason = self._choice.colour, None
        if topic is None or self.reading.depth_only:
            return
        try:
            reason = self._register(topic)
        except InputError as error:
            reason = str(error)
        if reason is not None:
            self.notes.append(f"colour of {topic} is not used, depth is read alone: {reason}")
            return
        self._colour_rows, times = self._times(topic)
        association = associate_colour(self.timestamps, times)
        self._partner = association.partner
        if association.note is not None:
            self.notes.append(association.note)

    def _register(self, topic: str) -> str | None:
        """Prepare colour of a topic for reading; return why that is impossible, None if it is not."""
        messages, depth = self._messages, self._own
        size = size_of_image(messages.first(topic), f"{self.path}: {topic}")
        colour = camera_of(messages, topic, size)
        if colour is None:
            return "the file does not describe its camera"
        if depth is None or not depth.frame:
            depth = camera_of(messages, self._choice.depth, (self.camera.width, self.camera.height))
        T = None if depth is None else transform_between(messages, self._choice.depth, depth, topic, colour)
        if T is None:
            return "the file does not state the transform between both cameras"
        same_camera = np.allclose(colour.camera.matrix, self.camera.matrix, rtol=1e-3, atol=0.1)
        if size == (self.camera.width, self.camera.height) and same_camera and np.allclose(T, np.eye(4), atol=1e-6):
            self._colour_undistortion = Undistortion.needed(colour.camera, colour.distortion)
            return None
        self._registration = Registration(self.camera, colour.camera, T, colour.distortion)
        self.notes.append(f"colour of {topic} is registered to the depth with the cameras that the file describes")
        return None

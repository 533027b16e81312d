"""Synthesis of recordings: frames with exact ground truth from a motion and options."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from depthtrack import __version__
from depthtrack.errors import InputError
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.options import check_seed
from depthtrack.recording.sequence import ImageKeypoints
from depthtrack.recording.writer import SequenceWriter
from depthtrack.synthesis.backdrop import Backdrop
from depthtrack.synthesis.held_object import HeldKind, HeldObject
from depthtrack.synthesis.keypoints import KeypointErrors, detected_keypoints
from depthtrack.synthesis.motion import Motion, frame_times, load_motion
from depthtrack.synthesis.painting import Painter, SkinTone, flip_skin
from depthtrack.synthesis.randomness import Stream, generator
from depthtrack.synthesis.room import add_room, add_wall
from depthtrack.synthesis.scene import HandKind, Scene
from depthtrack.synthesis.scene_frame import mirrored
from depthtrack.synthesis.sensors import Sensor, make_sensor
from depthtrack.synthesis.sensors.ideal import with_gaussian_noise
from depthtrack.synthesis.viewpoint import Viewpoint
from depthtrack.types import Array, Image, Mask

BackgroundKind = Literal["none", "wall", "room"]
SensorName = Literal["ideal", "kinect1", "kinect2", "realsense"]

_FLESH = 0.01
"""Depth of flesh before a keypoint, metres."""


@dataclass(frozen=True)
class Synthesis:
    """Options of a synthetic recording; equal options give equal bytes.

    distance: metres from the camera to the nominal palm position; None for the sensor's default, or farther if the hand
        came nearer than the sensor's range.
    forearm: whether a forearm is rendered; None means if there is a background.
    held_object: object in the palm, which moves with it and stops the fingers.
    held_size: its size, metres: the diameter of a sphere, the longest side of a box, 1.4 diameters of a cylinder.
    depth_noise: standard deviation of additional depth noise, metres.
    skin_flips: share of pixels with a flipped skin label, 0 to 1.
    frames: number of frames; None for the whole motion.
    rate: frames a second, Hz.
    keypoints: errors of 2D keypoints that are written too; None for no keypoints.
    """

    motion: str = "everyday"
    distance: float | None = None
    viewpoint: int = 0
    hand: HandShape = field(default_factory=HandShape)
    model: HandKind = "primitives"
    forearm: bool | None = None
    background: BackgroundKind = "none"
    sensor: SensorName = "ideal"
    held_object: HeldKind = "none"
    held_size: float = 0.06
    depth_noise: float = 0.0
    skin_flips: float = 0.0
    frames: int | None = None
    rate: float = 30.0
    seed: int = 0
    keypoints: KeypointErrors | None = None

    def __post_init__(self) -> None:
        kinds = {"background": BackgroundKind, "model": HandKind, "sensor": SensorName, "held_object": HeldKind}
        for name, kind in kinds.items():
            if getattr(self, name) not in get_args(kind):
                raise InputError(f"{name} must be one of {', '.join(get_args(kind))}, found {getattr(self, name)!r}")
        if not 0.01 <= self.held_size <= 0.2:
            raise InputError(f"the held object must measure 10 to 200 mm, found {self.held_size * 1000:g} mm")
        if not 0 <= self.depth_noise <= 0.5:
            raise InputError(f"depth noise must lie between 0 and 500 mm, found {self.depth_noise * 1000:g} mm")
        if not 0 <= self.skin_flips <= 1:
            raise InputError(f"skin flips must lie between 0 and 100 %, found {self.skin_flips * 100:g} %")
        if not 1 <= self.rate <= 1000:
            raise InputError(f"the frame rate must lie between 1 and 1000 Hz, found {self.rate:g} Hz")
        check_seed(self.seed)


@dataclass(frozen=True)
class SyntheticFrame:
    """A frame and its ground truth.

    timestamp: seconds.
    depth (h, w): sensor reading, metres; 0 without a reading.
    colour (h, w, 3): RGB.
    mask (h, w): visible hand up to the wrist, also without a sensor reading.
    skin (h, w): visible skin of hand, forearm and bystander, with flipped labels.
    exact_depth (h, w): rendered depth, metres.
    pose (27,): camera frame, see `hand.pose`.
    joints (21, 3): keypoints, metres, camera frame.
    keypoints: as a detector finds them in the image, None without one.
    """

    timestamp: float
    depth: Array
    colour: Image
    mask: Mask
    skin: Mask
    exact_depth: Array
    pose: Array
    joints: Array
    keypoints: ImageKeypoints | None = None


class Synthesiser:
    """Random access to the frames of a synthetic recording, from any thread."""

    def __init__(self, options: Synthesis) -> None:
        self.options = options
        self.motion: Motion = load_motion(options.motion)
        self.sensor: Sensor = make_sensor(options.sensor)
        self.timestamps: Array = frame_times(self.motion, options.rate, options.frames)
        self.held = self._held_object()
        self.distance: float = self._default_distance() if options.distance is None else options.distance
        self.viewpoint = Viewpoint(options.viewpoint, self.distance)
        self.poses: Array = self._poses()
        self.joints: Array = HandModel(options.hand).keypoints(self.poses)
        self._tone = SkinTone.sample(self._random(0, Stream.SKIN))
        backdrop = self._backdrop(self._random(0, Stream.ROOM))
        self._scene = Scene(options.hand, options.model, self.has_forearm, self.sensor.camera, backdrop, self.held)
        self._painter = Painter(
            options.hand,
            self.sensor.camera,
            backdrop,
            self._tone,
            self.sensor.colour_noise,
            self._random(0, Stream.LIGHT),
            None if self.held is None else self.held.colour,
        )

    def __len__(self) -> int:
        return len(self.timestamps)

    @property
    def has_forearm(self) -> bool:
        """Return whether a forearm is rendered."""
        return self.options.background != "none" if self.options.forearm is None else self.options.forearm

    def __getitem__(self, index: int) -> SyntheticFrame:
        rendered = self._scene.render(self.poses[index], self._elbow)
        surface = rendered.surface
        depth = self.sensor.read(surface, self._random(index, Stream.DEPTH))
        if self.options.depth_noise > 0:
            depth = with_gaussian_noise(depth, self.options.depth_noise, self._random(index, Stream.DEPTH_NOISE))
        colour, skin = flip_skin(
            self._painter.paint(rendered, self._random(index, Stream.COLOUR)),
            surface.label,
            self.options.skin_flips,
            self._tone,
            self._random(index, Stream.FLIPS),
        )
        return SyntheticFrame(
            timestamp=float(self.timestamps[index]),
            depth=depth,
            colour=colour,
            mask=self._scene.hand_mask(rendered),
            skin=skin,
            exact_depth=surface.depth,
            pose=self.poses[index],
            joints=self.joints[index],
            keypoints=self._keypoints(index),
        )

    def frames(self, threads: int = 2) -> Iterator[SyntheticFrame]:
        """Yield all frames in order, synthesised by `threads` workers with a bounded queue."""
        with ThreadPoolExecutor(threads, thread_name_prefix="synthesise") as pool:
            waiting: deque[Future[SyntheticFrame]] = deque()
            for index in range(len(self)):
                waiting.append(pool.submit(self.__getitem__, index))
                if len(waiting) > 2 * threads:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()

    def description(self) -> dict[str, Any]:
        """Return the content of `sequence.json`: all options and the program's version."""
        options = asdict(self.options) | {"distance": self.distance, "forearm": self.has_forearm, "frames": len(self)}
        options["hand"] = self.options.hand.side
        if self.options.keypoints is None:
            del options["keypoints"]
        if self.options.hand.rig is not None and self.options.model == "skin":
            options |= {"model": "rig", "rig": self.options.hand.rig.path.name, "sha256": self.options.hand.rig.sha256}
        return {"made_by": f"depthtrack {__version__} synth", "about": self.motion.about, **options}

    def _keypoints(self, index: int) -> ImageKeypoints | None:
        errors, random = self.options.keypoints, self._random(index, Stream.KEYPOINTS)
        if errors is None:
            return None
        return detected_keypoints(self.joints[index], self.sensor.camera, self.options.hand.side, errors, random)

    def _backdrop(self, rng: np.random.Generator) -> Backdrop:
        backdrop = Backdrop.empty(self.sensor.camera, face=SkinTone.sample(rng).back)
        if self.options.background == "wall":
            add_wall(backdrop, self.distance, rng)
        elif self.options.background == "room":
            add_room(backdrop, self.distance, rng)
        return backdrop

    def _poses(self) -> Array:
        return self.viewpoint.transform_poses(self._scene_poses)

    @cached_property
    def _scene_poses(self) -> Array:
        """The poses (T, 27) in the scene frame."""
        poses, hand = self.motion.poses(self.timestamps, self.options.seed), self.options.hand
        sided = poses if hand.side == "right" else mirrored(poses)
        return sided if self.held is None else self.held.opened(sided, hand)

    def _default_distance(self) -> float:
        """Return the default distance, metres, or a larger one with the hand in the sensor's range."""
        default = self.sensor.default_distance
        poses = Viewpoint(self.options.viewpoint, default).transform_poses(self._scene_poses)
        nearest = float(HandModel(self.options.hand).keypoints(poses)[..., 2].min())
        missing = self.sensor.nearest + _FLESH - nearest
        return default if missing <= 0 else round(default + missing, 2) + 0.01

    def _held_object(self) -> HeldObject | None:
        options = self.options
        if options.held_object == "none":
            return None
        rng = self._random(0, Stream.HELD)
        return HeldObject.sample(options.held_object, options.held_size, options.hand, rng)

    @cached_property
    def _elbow(self) -> Array:
        """Return the elbow position (3,), metres, camera frame."""
        elbow = self.motion.elbow + self._random(0, Stream.ARM).uniform(-0.04, 0.04, 3)
        return self.viewpoint.transform_points(elbow * [self.options.hand.mirror, 1, 1])

    def _random(self, frame: int, stream: Stream) -> np.random.Generator:
        return generator(self.options.seed, frame, stream)


def write_recording(
    synthesiser: Synthesiser,
    folder: Path,
    overwrite: bool = False,
    threads: int = 2,
    progress: Callable[[Iterator[SyntheticFrame]], Iterable[SyntheticFrame]] = iter,
) -> None:
    """Write a synthetic recording to a sequence folder, atomically.

    progress: wraps the iterator of frames, for a progress bar.
    Raises: InputError if the folder exists already and `overwrite` is False, or cannot be written.
    """
    with SequenceWriter(
        folder,
        synthesiser.sensor.camera,
        hand=synthesiser.options.hand.with_(rig=None),
        description=synthesiser.description(),
        # JPEG subsamples chroma, which would undo flips of single pixels.
        colour_format="png" if synthesiser.options.skin_flips > 0 else "jpg",
        overwrite=overwrite,
        threads=threads,
    ) as writer:
        for frame in progress(synthesiser.frames(threads)):
            writer.append(
                frame.timestamp,
                frame.depth,
                colour=frame.colour,
                mask=frame.mask,
                exact_depth=frame.exact_depth,
                pose=frame.pose,
                joints=frame.joints,
                keypoints=frame.keypoints,
                copied=False,
            )

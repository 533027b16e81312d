"""Synthetic optical marker captures of moving hands and rigid bodies, with exact truth."""

from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from depthtrack import __version__
from depthtrack.errors import InputError
from depthtrack.geometry.rotations import quaternion_from_matrix, quaternion_product
from depthtrack.hand.pose import ORIENTATION, POSITION, make_pose
from depthtrack.hand.shape import HandShape, other_side
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.models.layout import Layout, find_layout
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.options import check_seed
from depthtrack.synthesis.marker_measurement import MeasurementErrors
from depthtrack.synthesis.motion import Motion, frame_times, load_motion
from depthtrack.synthesis.random_hand import random_hand
from depthtrack.synthesis.random_motion import smooth_walk
from depthtrack.synthesis.randomness import Stream, generator
from depthtrack.synthesis.scene_frame import mirrored, orientation
from depthtrack.synthesis.two_hands import two_hand_poses
from depthtrack.types import Array

RANDOM_DURATION = 5.0
"""Default duration of a random motion, seconds: that of the trials of Maycock et al. 2015, Sec. IV."""
_T_CAPTURE_SCENE = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 1], [0, 0, 0, 1]])
"""The capture frame has z up; the nominal palm position is 1 m above its origin."""
_BODY_HALF = (0.02, 0.06)
"""Smallest and largest distance of a rigid body's markers from its origin, metres."""
_BODY_APART, _BODY_BELOW = 0.2, 0.25
"""Distance between rigid bodies, and of them below the hands, metres."""
_BODY_WANDER = np.array([[-0.05, 0.05]] * 3 + [[-0.8, 0.8]] * 3)
"""Limits of a rigid body's motion, metres, and of its angles, radians."""
_BODY_STEPS = (0.5, 1.5)
"""Shortest and longest step of that motion, seconds."""


@dataclass(frozen=True)
class MarkerSynthesis:
    """Options of a synthetic marker capture; equal options give equal bytes.

    layout: name of an included layout, or path of a JSON file.
    hand: sizes and side that the user's models have.
    two_hands: whether the other hand moves too.
    touching: whether two hands approach until they touch, again and again.
    rigid_bodies, rigid_markers: number of rigid bodies, and of the markers on each.
    start: time in the motion of the first frame, seconds.
    frames: number of frames; None for the rest of the motion, or 5 s of a random one.
    rate: frames a second, Hz.
    size_spread: spread of the subject's hand sizes about `hand`, as a share of that among people.
    placement: standard deviation of the markers' positions on the subject about the layout's, metres, each axis.

    Raises:
        InputError: if a value is out of range.
    """

    motion: str = "everyday"
    layout: str = "26"
    hand: HandShape = field(default_factory=HandShape)
    two_hands: bool = False
    touching: bool = False
    rigid_bodies: int = 0
    rigid_markers: int = 4
    start: float = 0.0
    frames: int | None = None
    rate: float = 200.0
    size_spread: float = 1.0
    placement: float = 0.002
    errors: MeasurementErrors = field(default_factory=MeasurementErrors)
    seed: int = 0

    def __post_init__(self) -> None:
        if not 1 <= self.rate <= 2000:
            raise InputError(f"the frame rate must lie between 1 and 2000 Hz, found {self.rate:g} Hz")
        if self.touching and not self.two_hands:
            raise InputError("only two hands can touch: add the other hand")
        if not 0 <= self.rigid_bodies <= 20 or not 3 <= self.rigid_markers <= 20:
            raise InputError("there can be 0 to 20 rigid bodies of 3 to 20 markers each")
        if not 0 <= self.size_spread <= 2:
            raise InputError(f"the spread of hand sizes must lie between 0 and 2, found {self.size_spread:g}")
        if not 0 <= self.placement <= 0.02:
            raise InputError(f"placement errors must lie between 0 and 20 mm, found {self.placement * 1000:g} mm")
        check_seed(self.seed)

    def description(self) -> dict[str, Any]:
        """Return all options as JSON values, and the program's version."""
        return {"made_by": f"depthtrack {__version__} synth", **asdict(self), "hand": self.hand.to_fields()}


@dataclass(frozen=True, eq=False)
class SyntheticMarkers:
    """A synthetic capture and its truth. The tuples have an entry for each model.

    truth: labels and poses of `capture`, with the models of the subject.
    positions: (T, M, 3) all markers, metres, capture frame, without noise.
    models: those that a user has: the layout on `options.hand`, and measured rigid bodies.
    """

    options: MarkerSynthesis
    truth: LabelledCapture
    positions: tuple[Array, ...]
    models: tuple[MarkerModel, ...]

    @property
    def capture(self) -> MarkerCapture:
        """The measured points without labels, in another order in each frame."""
        return self.truth.capture

    @cached_property
    def complete(self) -> MarkerCapture:
        """All true markers, labelled as `truth.labels`, without noise and gaps."""
        labels = tuple(label for k in range(len(self.models)) for label in self.truth.labels(k))
        return MarkerCapture(self.options.rate, labels, np.concatenate(self.positions, axis=1))


def synthesise_markers(options: MarkerSynthesis) -> SyntheticMarkers:
    """Return a capture of a motion with its truth.

    Raises:
        InputError: if the motion or the layout is unknown, or the motion is shorter than the frames asked for.
    """
    motion, layout = load_motion(options.motion), find_layout(options.layout)
    frames = (
        round(RANDOM_DURATION * options.rate) if options.frames is None and motion.duration is None else options.frames
    )
    times = frame_times(motion, options.rate, frames, options.start)
    nominal = [layout.on(hand) for hand in _hands(options.hand, options.two_hands)]
    bodies = [_rigid_body(options, k) for k in range(options.rigid_bodies)]
    subject = (*(_worn(options, layout, model) for model in nominal), *bodies)
    scene = [
        *_hand_poses(options, motion, subject, times),
        *(_body_poses(options, k, times) for k in range(len(bodies))),
    ]
    poses = tuple(_to_capture_frame(p) for p in scene)
    positions = tuple(model.positions(p) for model, p in zip(subject, poses, strict=True))
    points, columns = options.errors.measure(np.concatenate(positions, axis=1), options.rate, options.seed)
    labels = tuple(f"*{n + 1}" for n in range(points.shape[1]))
    split = np.split(columns, np.cumsum([len(model.labels) for model in subject])[:-1], axis=1)
    truth = LabelledCapture(
        MarkerCapture(options.rate, labels, points),
        subject,
        tuple(split),
        poses,
        tuple(np.where(c >= 0, 1.0, np.nan) for c in split),
    )
    measured = tuple(_measured_body(options, k, model) for k, model in enumerate(bodies))
    return SyntheticMarkers(options, truth, positions, (*nominal, *measured))


def _hands(hand: HandShape, two: bool) -> tuple[HandShape, ...]:
    """Return the hands: the right one first if there are two."""
    if not two:
        return (hand,)
    both = {hand.side: hand, other_side(hand.side): hand.with_(side=other_side(hand.side), rig=None)}
    return both["right"], both["left"]


def _worn(options: MarkerSynthesis, layout: Layout, nominal: MarkerModel) -> MarkerModel:
    """Return the layout on the subject's hand, with sizes and marker positions of its own."""
    hand = nominal.hand
    assert hand is not None
    if options.size_spread > 0:
        hand = random_hand(hand.side, None, options.seed, options.size_spread, hand)
    rng = generator(options.seed, 0 if hand.side == "right" else 1, Stream.SUBJECT)
    worn = layout.on(hand)
    return worn.with_(offsets=worn.offsets + rng.normal(0, options.placement, worn.offsets.shape))


def _hand_poses(
    options: MarkerSynthesis, motion: Motion, subject: tuple[MarkerModel, ...], times: Array
) -> list[Array]:
    hands = [model.hand for model in subject if model.hand is not None]
    if len(hands) == 2:
        return list(two_hand_poses(motion, (hands[0], hands[1]), times, options.seed, options.touching))
    poses = motion.poses(times, options.seed)
    return [poses if hands[0].side == "right" else mirrored(poses)]


def _rigid_body(options: MarkerSynthesis, k: int) -> MarkerModel:
    """Return a rigid body with markers at random distances in random directions."""
    count, rng = options.rigid_markers, generator(options.seed, k, Stream.RIGID_BODY)
    directions = rng.normal(size=(count, 3))
    offsets = directions / np.linalg.norm(directions, axis=1, keepdims=True) * rng.uniform(*_BODY_HALF, (count, 1))
    labels = tuple(str(n + 1) for n in range(count))
    return MarkerModel(f"body{k + 1}", labels, np.zeros(count, dtype=np.int64), offsets, np.zeros(count))


def _measured_body(options: MarkerSynthesis, k: int, model: MarkerModel) -> MarkerModel:
    """Return the rigid body as measured in a frame of another capture."""
    noise, rng = options.errors.noise, generator(options.seed, (1 << 32) + k, Stream.RIGID_BODY)
    return model.with_(
        offsets=model.offsets + rng.normal(0, noise, model.offsets.shape), spread=np.full(len(model.labels), noise)
    )


def _body_poses(options: MarkerSynthesis, k: int, times: Array) -> Array:
    """Return the poses (T, 27) of a rigid body that wanders below the hands, scene frame."""

    def walk(channel: int) -> Array:
        def draw(step: int) -> np.random.Generator:
            return generator(options.seed, (k << 48) + (channel << 40) + step, Stream.RIGID_MOTION)

        return np.asarray(smooth_walk(_BODY_WANDER[channel], _BODY_STEPS, float(times[-1]), draw)(times))

    place = np.array([(k - (options.rigid_bodies - 1) / 2) * _BODY_APART, _BODY_BELOW, 0.0])
    position = np.stack([walk(channel) for channel in range(3)], axis=-1) + place
    return make_pose(position, orientation(walk(3), walk(4), walk(5)), np.zeros((len(times), 20)))


def _to_capture_frame(poses: Array) -> Array:
    T = _T_CAPTURE_SCENE
    turned = quaternion_product(quaternion_from_matrix(T[:3, :3]), poses[..., ORIENTATION])
    return make_pose(poses[..., POSITION] @ T[:3, :3].T + T[:3, 3], turned, poses[..., 7:])

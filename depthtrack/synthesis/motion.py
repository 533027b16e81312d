"""Hand motions over time from TOML files: interpolated keyframes or seeded random motion."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from depthtrack.errors import InputError
from depthtrack.hand.pose import FINGERS, make_pose
from depthtrack.synthesis import motion_file
from depthtrack.synthesis.random_motion import RandomMotion
from depthtrack.synthesis.scene_frame import orientation
from depthtrack.types import Array

MAX_DURATION = 3600.0
"""Longest motion, seconds; at 30 Hz it has 108,000 frames."""
RANDOM_FRAMES = 360
"""Default number of frames of a random motion."""
_MAX_KEYS = 10_000
_SHORTEST = 0.001
_CHANNELS = ("position", "tilt", "nod", "turn", *FINGERS)


class Motion(Protocol):
    """The pose of a right hand over time, in the scene frame of `scene_frame`."""

    @property
    def name(self) -> str:
        """Return the name of the motion."""
        ...

    @property
    def about(self) -> str:
        """Return a one-line description."""
        ...

    @property
    def duration(self) -> float | None:
        """Return the duration in seconds; None if the motion has no end."""
        ...

    @property
    def elbow(self) -> Array:
        """Return the elbow position (3,), metres, scene frame."""
        ...

    def poses(self, times: ArrayLike, seed: int) -> Array:
        """Return the poses at given times; every angle is within its joint limits.

        times (T,): seconds.
        seed: seed of random motions; keyframed motions ignore it.
        Result (T, 27): scene frame.
        """
        ...


def load_motion(name: str) -> Motion:
    """Load a motion by its name or from a .toml file.

    Raises: InputError if no motion has that name or the file is invalid.
    """
    path = motion_file.find_motion(name)
    table = motion_file.read_table(path)
    if "like" in table:
        return _with_speed(path, table)
    if "random" in table:
        return RandomMotion.from_table(path.stem, table, str(path))
    return KeyframedMotion.from_table(path.stem, table, str(path))


def frame_times(motion: Motion, rate: float, frames: int | None, start: float = 0.0) -> Array:
    """Return the times (T,) of frames in a motion, seconds.

    rate: Hz.
    frames: their number; None for the whole motion, or 360 of a random motion.
    start: time of the first frame, seconds.

    Raises: InputError if the motion is too short.
    """
    longest = round(((MAX_DURATION if motion.duration is None else motion.duration) - start) * rate)
    count = (RANDOM_FRAMES if motion.duration is None else longest) if frames is None else frames
    if start < 0 or not 1 <= count <= longest:
        part = f" from {start:g} s on" if start else ""
        raise InputError(f"'{motion.name}' at {rate:g} Hz can have 1 to {max(longest, 0)} frames{part}, found {count}")
    return start + np.arange(count) / rate


@dataclass(frozen=True)
class KeyframedMotion:
    """A motion interpolated between keys, channel by channel.

    A channel is constant before its first key and after its last. The interpolation is piecewise cubic Hermite (Fritsch
    and Carlson 1980). It is monotone between keys, so it stays within the joint limits if the keys do.
    """

    name: str
    about: str
    duration: float
    channels: dict[str, tuple[Array, Array]]
    """Key times (K,) in seconds and values (K, size) of each channel: metres and radians."""
    elbow: Array
    speed: float = 1.0

    @classmethod
    def from_table(cls, name: str, table: dict[str, Any], where: str) -> "KeyframedMotion":
        """Return the motion of a parsed file; `where` names it in error messages.

        Raises: InputError if an entry is missing, unknown or out of range.
        """
        motion_file.check_names(table, ("about", "keys", "postures", "elbow"), where)
        postures = motion_file.shared_postures(table, where)
        keys = motion_file.tables(table, "keys", _MAX_KEYS, where)
        channels: dict[str, tuple[list[float], list[Array]]] = {channel: ([], []) for channel in _CHANNELS}
        last = -1.0
        for n, key in enumerate(keys):
            place = f"{where}, key {n + 1}"
            motion_file.check_names(key, ("at", "posture", *_CHANNELS), place)
            at = motion_file.number(key, "at", 0, MAX_DURATION, place)
            if at < last + _SHORTEST:
                raise InputError(
                    f"{place}: keys must be in order of time and at least 1 ms apart, found {at:g} s after {last:g} s"
                )
            last = at
            for channel, value in _values(key, postures, place).items():
                channels[channel][0].append(at)
                channels[channel][1].append(value)
        missing = [finger for finger in FINGERS if not channels[finger][0]]
        if missing:
            raise InputError(f"{where}: at least one key must set a posture, or {', '.join(missing)}")
        if last <= 0:
            raise InputError(f"{where}: the last key ends the motion, so it must lie after 0 s, found {last:g} s")
        arrays = {channel: (np.array(t), np.array(values)) for channel, (t, values) in channels.items() if t}
        return cls(name, motion_file.text(table, "about", where), last, arrays, motion_file.elbow(table, where))

    def poses(self, times: ArrayLike, seed: int) -> Array:
        """See `Motion`."""
        t = np.asarray(times, dtype=np.float64) * self.speed
        tilt, nod, turn = (self._channel(name, t, 1)[:, 0] for name in ("tilt", "nod", "turn"))
        angles = np.concatenate([self._channel(finger, t, 4) for finger in FINGERS], axis=-1)
        return make_pose(self._channel("position", t, 3), orientation(tilt, nod, turn), angles)

    def _channel(self, name: str, times: Array, size: int) -> Array:
        keys, values = self.channels.get(name, (np.zeros(1), np.zeros((1, size))))
        if len(keys) == 1:
            return np.broadcast_to(values, (len(times), size))
        return np.asarray(PchipInterpolator(keys, values)(np.clip(times, keys[0], keys[-1])))


def _values(key: dict[str, Any], postures: dict[str, Array], where: str) -> dict[str, Array]:
    """Return the values that a key sets, by channel."""
    values: dict[str, Array] = {}
    if "posture" in key:
        name = motion_file.text(key, "posture", where)
        if name not in postures:
            raise InputError(f"{where}: unknown posture '{name}', use {', '.join(postures)}")
        values.update(zip(FINGERS, postures[name].reshape(5, 4), strict=True))
    values.update(motion_file.posture(key, where))
    if "position" in key:
        values["position"] = motion_file.numbers(key["position"], 3, 1000, f"{where}, position in mm") / 1000
    for name in ("tilt", "nod", "turn"):
        if name in key:
            values[name] = np.radians([motion_file.number(key, name, -720, 720, where)])
    return values


def _with_speed(path: Path, table: dict[str, Any]) -> Motion:
    """Return another keyframed motion at `speed` times its rate."""
    where = str(path)
    motion_file.check_names(table, ("about", "like", "speed"), where)
    speed = motion_file.number(table, "speed", 0.05, 20, where)
    original = motion_file.find_motion(motion_file.text(table, "like", where))
    motion = KeyframedMotion.from_table(original.stem, motion_file.read_table(original), str(original))
    about = motion_file.text(table, "about", where)
    return KeyframedMotion(path.stem, about, motion.duration / speed, motion.channels, motion.elbow, speed)

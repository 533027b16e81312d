"""Motions of a hand over time: keyframed ones, interpolated smoothly, and random ones; both come from small files."""

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
"""Longest motion, in seconds: an hour at 30 Hz is 100,000 frames."""
_MAX_KEYS = 10_000
_SHORTEST = 0.001
_CHANNELS = ("position", "tilt", "nod", "turn", *FINGERS)


class Motion(Protocol):
    """A right hand's pose over time, in the scene frame."""

    @property
    def name(self) -> str: ...

    @property
    def about(self) -> str:
        """One line for people."""
        ...

    @property
    def duration(self) -> float | None:
        """Seconds; None for a motion of any length."""
        ...

    @property
    def elbow(self) -> Array:
        """(3,) where the forearm comes from, scene frame, metres."""
        ...

    def poses(self, times: ArrayLike, seed: int) -> Array:
        """Poses (T, 27) at `times` (T,) seconds, every angle within its limits; `seed` matters to random motions."""
        ...


def load_motion(name: str) -> Motion:
    """The motion of that name, or in that .toml file. Raises InputError saying what is wrong with it."""
    path = motion_file.find_motion(name)
    table = motion_file.read_table(path)
    if "like" in table:
        return _at_other_speed(path, table)
    if "random" in table:
        return RandomMotion.from_table(path.stem, table, str(path))
    return KeyframedMotion.from_table(path.stem, table, str(path))


@dataclass(frozen=True)
class KeyframedMotion:
    """Channels of keys, each interpolated by itself; before its first and after its last key a channel rests.

    Piecewise cubic Hermite interpolation after Fritsch and Carlson 1980: smooth, and monotone between keys, so that
    nothing overshoots: with its keys within the joint limits, the whole motion is.
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
        """Build from a parsed motion file; `where` names it in error messages. Raises InputError."""
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
                raise InputError(f"{place}: keys must be in order of time, 1 ms apart; found {at:g} s after {last:g} s")
            last = at
            for channel, value in _values(key, postures, place).items():
                channels[channel][0].append(at)
                channels[channel][1].append(value)
        missing = [finger for finger in FINGERS if not channels[finger][0]]
        if missing:
            raise InputError(f"{where}: some key must give a posture, or {', '.join(missing)}")
        if last <= 0:
            raise InputError(f"{where}: the last key must lie after 0 s: it ends the motion")
        arrays = {channel: (np.array(t), np.array(values)) for channel, (t, values) in channels.items() if t}
        return cls(name, motion_file.text(table, "about", where), last, arrays, motion_file.elbow(table, where))

    def poses(self, times: ArrayLike, seed: int) -> Array:
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
    """What a key sets, by channel."""
    values: dict[str, Array] = {}
    if "posture" in key:
        name = motion_file.text(key, "posture", where)
        if name not in postures:
            raise InputError(f"{where}: there is no posture '{name}'; use {', '.join(postures)}")
        values.update(zip(FINGERS, postures[name].reshape(5, 4), strict=True))
    values.update(motion_file.posture(key, where))
    if "position" in key:
        values["position"] = motion_file.numbers(key["position"], 3, 1000, f"{where}, position in mm") / 1000
    for name in ("tilt", "nod", "turn"):
        if name in key:
            values[name] = np.radians([motion_file.number(key, name, -720, 720, where)])
    return values


def _at_other_speed(path: Path, table: dict[str, Any]) -> Motion:
    """The motion of a file that only says: like that one, so many times as fast."""
    where = str(path)
    motion_file.check_names(table, ("about", "like", "speed"), where)
    speed = motion_file.number(table, "speed", 0.05, 20, where)
    original = motion_file.find_motion(motion_file.text(table, "like", where))
    motion = KeyframedMotion.from_table(original.stem, motion_file.read_table(original), str(original))
    about = motion_file.text(table, "about", where)
    return KeyframedMotion(path.stem, about, motion.duration / speed, motion.channels, motion.elbow, speed)

"""Rigid transforms between the cameras of a bag."""

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from depthtrack.errors import DamagedFrameError
from depthtrack.recording.bags.messages import Messages
from depthtrack.types import Array

TF_MESSAGE = "tf2_msgs/msg/TFMessage"
_MOST_MESSAGES = 200
"""Messages of static transforms that are read."""


def static_transform(messages: Messages, source: str, target: str) -> Array | None:
    """Return the transform (4, 4) between two frames by /tf_static, metres; None if unknown."""
    parents = _static_tree(messages)
    to_source, to_target = _to_root(source, parents), _to_root(target, parents)
    if to_source is None or to_target is None or to_source[0] != to_target[0]:
        return None
    return np.linalg.inv(to_target[1]) @ to_source[1]


def realsense_transform(messages: Messages, depth: str, colour: str) -> Array | None:
    """Return the transform (4, 4) between two RealSense streams, metres; None if not stated.

    A topic `STREAM/tf/N` holds the transform from a reference, the same for equal N, to the stream.
    """
    for name in messages.topics:
        if not name.startswith(f"{depth}/tf/"):
            continue
        other = colour + name[len(depth) :]
        if other not in messages.topics:
            continue
        try:
            T_depth, T_colour = (_realsense_pose(messages.first(each)) for each in (name, other))
        except (DamagedFrameError, ValueError):
            continue
        return T_colour @ np.linalg.inv(T_depth)
    return None


def _static_tree(messages: Messages) -> dict[str, tuple[str, Array]]:
    """Return the parent of each frame, and the transform to it."""
    found: dict[str, tuple[str, Array]] = {}
    for name, topic in messages.topics.items():
        if topic.kind != TF_MESSAGE or not name.endswith("tf_static"):
            continue
        for index in range(min(_MOST_MESSAGES, len(messages.storage.times(name)))):
            try:
                transforms = messages.decode(name, index).transforms
            except DamagedFrameError:
                continue
            for each in transforms:
                pose = _transform(each.transform)
                if pose is not None:
                    found[str(each.child_frame_id).lstrip("/")] = (str(each.header.frame_id).lstrip("/"), pose)
    return found


def _to_root(frame: str, parents: dict[str, tuple[str, Array]]) -> tuple[str, Array] | None:
    """Return the root above a frame and the transform to it; None in a circle of frames."""
    pose = np.eye(4)
    for _ in range(len(parents) + 1):
        if frame not in parents:
            return frame, pose
        frame, step = parents[frame]
        pose = step @ pose
    return None


def _transform(message: Any) -> Array | None:
    """Return the matrix (4, 4) of a geometry_msgs/Transform; None if its quaternion is zero."""
    q, t = message.rotation, message.translation
    quaternion = np.array([q.x, q.y, q.z, q.w], dtype=np.float64)
    if not 0.9 < np.linalg.norm(quaternion) < 1.1:  # false for NaN
        return None
    T = np.eye(4)
    T[:3, :3] = Rotation.from_quat(quaternion).as_matrix()
    T[:3, 3] = t.x, t.y, t.z
    return T


def _realsense_pose(message: Any) -> Array:
    """Return the matrix of a Transform, or of the text that newer files have instead.

    The text is `rotation=...;translation=...`, with the rotation by columns. Raises ValueError if it is malformed.
    """
    if not hasattr(message, "data"):
        pose = _transform(message)
        if pose is None:
            raise ValueError("no rotation")
        return pose
    fields = dict(part.split("=", 1) for part in str(message.data).split(";") if "=" in part)
    rotation, translation = (
        np.array([float(number) for number in fields.get(name, "").split(",")]) for name in ("rotation", "translation")
    )
    T = np.eye(4)
    T[:3, :3] = rotation.reshape(3, 3).T
    T[:3, 3] = translation.reshape(3)
    return T

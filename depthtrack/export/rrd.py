"""Export to rerun's .rrd: the 21 keypoints with their bones, and figures over time.

It needs the extra `view` (rerun-sdk). `depthtrack view RUN --rrd FILE` writes the recording and the surface as well.
"""

import importlib
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.errors import MissingExtraError
from depthtrack.export.joint_track import JointTrack
from depthtrack.files import replace_atomically
from depthtrack.hand.kinematics import KEYPOINT_NAMES
from depthtrack.hand.pose import FINGERS

_HAND_CLASS = 1
_POINT_RADIUS = 0.003
"""Radius of a drawn keypoint, metres."""


def write(track: JointTrack, path: Path) -> None:
    """Write keypoints as points `world/hand`, and `run/confidence` and `run/energy` as scalars.

    The timelines are `time` (s) and `frame`. The points are cleared in frames without a pose.

    Raises:
        InputError: if the file cannot be written.
        MissingExtraError: if rerun is not installed.
    """
    rr = rerun_library()
    with replace_atomically(path) as temporary:
        stream = rr.RecordingStream("depthtrack", recording_id=None)
        try:
            stream.save(temporary)
            _log(rr, stream, track)
        finally:
            stream.flush()
            stream.disconnect()


def rerun_library() -> Any:
    """Import rerun.

    Raises:
        MissingExtraError: if it is not installed.
    """
    try:
        return importlib.import_module("rerun")
    except ImportError as error:
        raise MissingExtraError("rerun, its viewer and its files,", "view") from error


def _log(rr: Any, stream: Any, track: JointTrack) -> None:
    if track.frame == "camera":
        stream.log("world", rr.ViewCoordinates.RDF, static=True)
    hand = rr.ClassDescription(
        info=rr.AnnotationInfo(id=_HAND_CLASS, label=f"{track.hand.side} hand"),
        keypoint_annotations=[rr.AnnotationInfo(id=k, label=name) for k, name in enumerate(KEYPOINT_NAMES)],
        keypoint_connections=_bones(),
    )
    stream.log("world", rr.AnnotationContext([hand]), static=True)
    for row, index in enumerate(track.index.tolist()):
        stream.set_time("time", duration=float(track.timestamps[row]))
        stream.set_time("frame", sequence=index)
        if track.posed[row]:
            points = track.keypoints[row].astype(np.float32)
            numbers = list(range(len(points)))
            content = rr.Points3D(points, class_ids=_HAND_CLASS, keypoint_ids=numbers, radii=_POINT_RADIUS)
            stream.log("world/hand", content)
        else:
            stream.log("world/hand", rr.Clear(recursive=False))
        for name, values in (("confidence", track.confidence), ("energy", track.energy)):
            if np.isfinite(values[row]):
                stream.log(f"run/{name}", rr.Scalars(float(values[row])))


def _bones() -> list[tuple[int, int]]:
    """Return the pairs of keypoints that a bone joins."""
    chains = [[0, *(k for k, name in enumerate(KEYPOINT_NAMES) if name.startswith(finger))] for finger in FINGERS]
    return [bone for chain in chains for bone in pairwise(chain)]

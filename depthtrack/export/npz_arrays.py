"""Export to NumPy's .npz without pickles; NaN if there is no pose."""

from pathlib import Path

import numpy as np

from depthtrack.export.joint_track import JointTrack
from depthtrack.files import replace_atomically
from depthtrack.hand.kinematics import KEYPOINT_NAMES
from depthtrack.hand.pose import POSE_NAMES
from depthtrack.strict_data import exact_json_text

CONVENTIONS = {
    "length": "m",
    "angle": "rad",
    "time": "s",
    "frame": "camera: x right, y down, z forward",
    "quaternion": "w x y z, of the palm in the camera frame",
}


def write(track: JointTrack, path: Path) -> None:
    """Write a track's arrays, `pose_names`, `keypoint_names` and `conventions` (JSON).

    Raises:
        InputError: if the file cannot be written.
    """
    with replace_atomically(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(
            file,
            index=track.index,
            timestamps=track.timestamps,
            status=np.array(track.status, dtype=np.str_),
            energy=track.energy,
            agreement=track.agreement,
            confidence=track.confidence,
            visibility=track.visibility,
            spread=track.spread,
            poses=track.poses,
            keypoints=track.keypoints,
            pose_names=np.array(POSE_NAMES, dtype=np.str_),
            keypoint_names=np.array(KEYPOINT_NAMES, dtype=np.str_),
            conventions=np.array(exact_json_text(CONVENTIONS), dtype=np.str_),
        )

"""Track a hand and print the tip of its index finger: track_recording.py RECORDING [TRACKER] [HAND.json|RIG.glb]."""

import sys
from pathlib import Path

from depthtrack.hand.kinematics import KEYPOINT_NAMES, HandModel
from depthtrack.recording import open_sequence
from depthtrack.recording.hand_choice import chosen_hand
from depthtrack.tracking.registry import tracker_config
from depthtrack.tracking.run import TrackingRun, configure


def main(path: str, tracker_name: str = "ik", hand_name: str | None = None) -> int:
    """Print a line per frame; return the number of frames with a trusted pose."""
    recording = open_sequence(path)
    hand = chosen_hand(recording, hand_name)
    model, tip, trusted = HandModel(hand), "index_tip", 0
    configuration = configure(Path(path), recording, tracker_config(tracker_name), hand)
    with TrackingRun(configuration, recording) as run:
        for each in run.track():
            if each.estimate.pose is None or not each.estimate.status.is_trusted:
                continue
            trusted += 1
            x, y, z = 1000 * model.keypoints(each.estimate.pose)[KEYPOINT_NAMES.index(tip)]
            print(f"{each.frame.timestamp:8.3f} s  {tip} at {x:6.1f} {y:6.1f} {z:6.1f} mm")
    return trusted


if __name__ == "__main__":
    main(*sys.argv[1:])

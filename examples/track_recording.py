"""Track a hand and print the tip of its index finger: track_recording.py RECORDING [pso|ik] [HAND.json|RIG.glb]."""

import sys
from contextlib import closing

from depthtrack.hand.kinematics import KEYPOINT_NAMES, HandModel
from depthtrack.recording import open_sequence
from depthtrack.recording.hand_choice import chosen_hand
from depthtrack.recording.status import Status
from depthtrack.segmentation.observation import Segmenter
from depthtrack.tracking.registry import create_tracker


def main(path: str, tracker_name: str = "ik", hand_name: str | None = None) -> int:
    """Print a line a frame; return the number of frames with a trusted pose."""
    recording = open_sequence(path)
    hand = chosen_hand(recording, hand_name)
    model, segmenter, tip, trusted = HandModel(hand), Segmenter.for_sequence(recording), "index_tip", 0
    with closing(create_tracker(tracker_name, hand)) as tracker:
        for frame in recording:
            observation = segmenter.segment(frame)
            if observation is None:
                continue
            estimate = tracker.track(observation)
            if estimate.pose is None or estimate.status is Status.LOST:
                continue
            trusted += 1
            x, y, z = 1000 * model.keypoints(estimate.pose)[KEYPOINT_NAMES.index(tip)]
            print(f"{frame.timestamp:8.3f} s  {tip} at {x:6.1f} {y:6.1f} {z:6.1f} mm")
    return trusted


if __name__ == "__main__":
    main(*sys.argv[1:])

"""Track a recording and print where the tip of the index finger is.

Usage: 01_replay.py RECORDING [TRACKER] [HAND.json|RIG.glb|truth]
"""

import sys

import depthtrack as dt


def main(path: str, tracker: str = "ik", hand: str | None = None) -> int:
    """Print a line per frame with a trusted pose; return the number of these frames."""
    recording = dt.open_recording(path)
    sizes = dt.calibrate(recording).hand if hand is None else dt.open_hand(hand, recording)
    model = dt.HandModel(sizes)
    trusted = 0
    for each in dt.track(recording, sizes, tracker):
        if each.estimate.pose is None or not each.estimate.status.is_trusted:
            continue
        trusted += 1
        tip = model.keypoints(each.estimate.pose)[dt.KEYPOINT_NAMES.index("index_tip")]
        print(
            f"{each.frame.timestamp:8.3f} s  x {1000 * tip[0]:6.1f}  y {1000 * tip[1]:6.1f}  z {1000 * tip[2]:6.1f} mm"
        )
    return trusted


if __name__ == "__main__":
    main(*sys.argv[1:])

"""Track a hand with a RealSense camera; print its palm and the latency.

Usage: 14_realsense.py [SERIAL]

It needs the camera and  pip install 'depthtrack[realsense]'. It was run with a recorded file only.
"""

import sys
from itertools import islice

import depthtrack as dt


def main(serial: str | None = None, *, tracker: str = "hybrid", frames: int | None = None) -> dt.LiveReport:
    """Print each pose until Ctrl-C, or for some frames; return the figures."""
    report = dt.LiveReport()
    with dt.RealSenseSource(serial) as source, dt.HandTracker(source.camera, tracker=tracker) as hand_tracker:
        tracked = dt.track_live(dt.queue_frames(source), hand_tracker, smooth=dt.OneEuroFilter())
        for each in islice(tracked, frames):
            report.add(each)
            palm = "no hand" if each.pose is None else "palm at {:.3f} {:.3f} {:.3f} m".format(*each.pose[:3])
            print(f"{each.frame.timestamp:9.3f} s  {each.estimate.status:8}  {palm}  {1e3 * each.latency:.0f} ms")
    print(report.text())
    return report


if __name__ == "__main__":
    main(*sys.argv[1:])

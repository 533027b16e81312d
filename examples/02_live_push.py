"""Track frames as a sensor delivers them.

A frame is depth in the sensor's own units, colour and a time.
Usage: 02_live_push.py RECORDING. The recording stands for the sensor.
"""

import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

import depthtrack as dt


def sensor(recording: dt.Sequence) -> Iterator[tuple[NDArray[Any], NDArray[Any] | None, float]]:
    """Yield depth (h, w) uint16, colour (h, w, 3) and seconds, as the driver of a sensor would."""
    for frame in recording:
        units = np.rint(frame.depth / recording.camera.depth_scale).astype(np.uint16)
        yield units, frame.colour, frame.timestamp


def main(path: str, tracker: str = "ik", *, deadline: float | None = 33.0) -> NDArray[np.float64]:
    """Print and return the opening (T,) between thumb and index finger, metres.

    deadline: milliseconds after which a search goes on in the next frame; None for the same bits in each run.
    """
    recording = dt.open_recording(path)
    thumb, index = (dt.KEYPOINT_NAMES.index(name) for name in ("thumb_tip", "index_tip"))
    openings = []
    with dt.HandTracker(recording.camera, tracker=tracker, deadline=deadline) as hand_tracker:
        for depth, colour, seconds in sensor(recording):
            estimate = hand_tracker.update(depth, colour, timestamp=seconds)
            keypoints = hand_tracker.keypoints(estimate)
            openings.append(float(np.linalg.norm(keypoints[thumb] - keypoints[index])))
            print(f"{seconds:8.3f} s  {estimate.status:8}  opening {1000 * openings[-1]:5.1f} mm")
    return np.array(openings)


if __name__ == "__main__":
    main(*sys.argv[1:])

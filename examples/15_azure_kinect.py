"""Track a hand with an Azure Kinect by pyk4a.

It needs the camera, its SDK and  pip install pyk4a. It was tested with a stand-in for pyk4a, not with a camera.
"""

import sys
from collections.abc import Iterator
from itertools import islice
from time import perf_counter
from typing import Any

import numpy as np

import depthtrack as dt
from depthtrack.geometry.distortion import Distortion, Undistortion

RATE = 30


def frames(device: Any, camera: dt.Camera, undistortion: Undistortion) -> Iterator[dt.LiveFrame]:
    """Yield frames without distortion of the lens, with colour registered to the depth."""
    while True:
        capture = device.get_capture()
        arrival = perf_counter()
        if capture.depth is None or capture.transformed_color is None:
            continue
        seconds = capture.depth_timestamp_usec / 1e6
        colour = undistortion.colour(np.ascontiguousarray(capture.transformed_color[..., 2::-1]))  # of BGRA
        depth = undistortion.depth(camera.metres(capture.depth))
        yield dt.LiveFrame(round(seconds * RATE), seconds, depth, colour, arrival)


def main(*, tracker: str = "hybrid", count: int | None = None) -> dt.LiveReport:
    """Print each pose until Ctrl-C, or for some frames; return the figures."""
    try:
        import pyk4a
    except ImportError:
        sys.exit("this example needs the Azure Kinect SDK and  pip install pyk4a")
    report, device = dt.LiveReport(), pyk4a.PyK4A(pyk4a.Config(depth_mode=pyk4a.DepthMode.NFOV_UNBINNED))
    device.start()
    try:
        kind = pyk4a.CalibrationType.DEPTH
        K = device.calibration.get_camera_matrix(kind)
        camera = dt.Camera(640, 576, K[0, 0], K[1, 1], K[0, 2], K[1, 2], depth_scale=0.001)
        undistortion = Undistortion(camera, Distortion(tuple(device.calibration.get_distortion_coefficients(kind))))
        with dt.HandTracker(camera, tracker=tracker) as hand_tracker:
            source = frames(device, camera, undistortion)
            for each in islice(dt.track_live(dt.queue_frames(source), hand_tracker), count):
                report.add(each)
                print(each.estimate.status, each.pose)
    finally:
        device.stop()
    print(report.text())
    return report


if __name__ == "__main__":
    main()

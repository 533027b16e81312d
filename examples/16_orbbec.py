"""Track a hand with an Orbbec camera (Gemini, Femto, Astra) by pyorbbecsdk.

It needs the camera and  pip install pyorbbecsdk2. It was tested with a stand-in for pyorbbecsdk, not with a camera.
"""

import sys
from collections.abc import Iterator
from itertools import islice
from time import perf_counter
from typing import Any

import numpy as np

import depthtrack as dt


def frames(pipeline: Any, align: Any) -> Iterator[tuple[dt.LiveFrame, Any]]:
    """Yield frames with colour registered to the depth, and the profile of the depth stream."""
    while True:
        if (found := pipeline.wait_for_frames(1000)) is None or (aligned := align.process(found)) is None:
            continue
        depth, colour = (aligned := aligned.as_frame_set()).get_depth_frame(), aligned.get_color_frame()
        if depth is not None and colour is not None:
            profile = depth.get_stream_profile().as_video_stream_profile()
            shape = profile.get_height(), profile.get_width()
            # The depth scale is millimetres per unit.
            metres = np.frombuffer(depth.get_data(), np.uint16) * np.float32(depth.get_depth_scale() / 1000)
            image = np.frombuffer(colour.get_data(), np.uint8).reshape(*shape, 3)
            seconds = depth.get_timestamp_us() / 1e6
            yield dt.LiveFrame(depth.get_index(), seconds, metres.reshape(shape), image, perf_counter()), profile


def main(*, tracker: str = "hybrid", count: int | None = None) -> dt.LiveReport:
    """Print each pose until Ctrl-C, or for some frames; return the figures."""
    try:
        import pyorbbecsdk as ob
    except ImportError:
        sys.exit("this example needs  pip install pyorbbecsdk2")
    report, pipeline, config = dt.LiveReport(), ob.Pipeline(), ob.Config()
    for sensor, form in (("DEPTH_SENSOR", "Y16"), ("COLOR_SENSOR", "RGB")):
        profiles = pipeline.get_stream_profile_list(getattr(ob.OBSensorType, sensor))
        config.enable_stream(profiles.get_video_stream_profile(640, 0, getattr(ob.OBFormat, form), 30))
    pipeline.start(config)
    try:
        source = frames(pipeline, ob.AlignFilter(align_to_stream=ob.OBStreamType.DEPTH_STREAM))
        lens, (height, width) = (first := next(source))[1].get_intrinsic(), first[0].depth.shape
        camera = dt.Camera(width, height, lens.fx, lens.fy, lens.cx, lens.cy)
        with dt.HandTracker(camera, tracker=tracker) as hand_tracker:
            waiting = dt.queue_frames(frame for frame, _ in source)
            for each in islice(dt.track_live(waiting, hand_tracker), count):
                report.add(each)
                print(each.estimate.status, each.pose)
    finally:
        pipeline.stop()
    return report


if __name__ == "__main__":
    print(main().text())

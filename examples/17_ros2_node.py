"""A ROS 2 node that tracks a hand: from depth images to a PoseArray of 21 keypoints.

Usage: 17_ros2_node.py [DEPTH_TOPIC [CAMERA_INFO_TOPIC [TRACKER]]]

It needs a ROS 2 environment. It was tested with stand-ins for rclpy and the messages, not with ROS.
"""

import sys
from queue import SimpleQueue
from threading import Thread
from time import perf_counter
from typing import Any

import numpy as np

import depthtrack as dt


def depth_of(message: Any) -> np.ndarray[Any, Any]:
    """Return the depth (h, w) of an Image, 16UC1 in millimetres or 32FC1 in metres, as metres."""
    kind = {"16UC1": "u2", "mono16": "u2", "32FC1": "f4"}[message.encoding]
    values = np.frombuffer(message.data, np.dtype(kind).newbyteorder(">" if message.is_bigendian else "<"))
    image = values.reshape(message.height, -1)[:, : message.width].astype(np.float32)
    return np.nan_to_num(image if kind == "f4" else image / 1000, posinf=0, neginf=0)


def main(topic: str = "/camera/depth/image_raw", info: str = "/camera/depth/camera_info", tracker: str = "ik") -> None:
    """Track until Ctrl-C, and publish the keypoints on `hand/keypoints`."""
    try:
        import rclpy
        from geometry_msgs.msg import Point, Pose, PoseArray
        from rclpy.qos import qos_profile_sensor_data
        from sensor_msgs.msg import CameraInfo, Image
    except ImportError:
        sys.exit("this example needs a ROS 2 environment: source /opt/ros/DISTRIBUTION/setup.bash")
    rclpy.init()
    node = rclpy.create_node("depthtrack")
    frames, cameras = SimpleQueue[dt.LiveFrame](), SimpleQueue[Any]()
    publisher = node.create_publisher(PoseArray, "hand/keypoints", 10)

    def receive(message: Any) -> None:
        time = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        frames.put(dt.LiveFrame(time, time / 1e9, depth_of(message), None, perf_counter()))

    node.create_subscription(Image, topic, receive, qos_profile_sensor_data)
    node.create_subscription(CameraInfo, info, cameras.put, qos_profile_sensor_data)
    Thread(target=rclpy.spin, args=(node,), daemon=True).start()
    fx, _, cx, _, fy, cy, *_ = (lens := cameras.get()).k
    with dt.HandTracker(dt.Camera(lens.width, lens.height, fx, fy, cx, cy), tracker=tracker) as hand_tracker:
        for each in dt.track_live(dt.queue_frames(iter(frames.get, None)), hand_tracker):
            points = hand_tracker.keypoints(each.estimate).tolist() if each.pose is not None else []
            found = PoseArray(poses=[Pose(position=Point(x=x, y=y, z=z)) for x, y, z in points])
            found.header.frame_id = lens.header.frame_id
            publisher.publish(found)


if __name__ == "__main__":
    main(*sys.argv[1:])

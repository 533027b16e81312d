"""Bags of ROS 1 and ROS 2: containers, messages, and the cameras that they describe.

The containers are read here instead of by the library `rosbags`, which refuses files that are cut short and has no
bound on decompressed sizes. `rosbags` decodes the messages and writes files.
"""

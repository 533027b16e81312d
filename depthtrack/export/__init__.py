"""Joints of every frame in files that others read: tables, arrays, and the text format of public benchmarks.

One file a format; `docs/joints.md` has the names, their order, the frame and the units.
"""

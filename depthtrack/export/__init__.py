"""Export of a run's poses and joints to tables, arrays and the files of public benchmarks.

One module a format. `docs/joints.md` lists the names, their order, the frame and the units.
"""

"""Export of a run's poses and joints to tables, arrays and the files of public benchmarks.

One module a format. `docs/exports.md` states the names, their order, the frame and the units.
"""

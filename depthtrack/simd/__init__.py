"""SIMD vectors inside numba kernels.

The vectors rely on numba's internals: data models, typing templates and the code generator. `pyproject.toml` therefore
bounds numba from above by the minor version after the newest one that was tested, 0.68. To raise the bound, run the
tests of `simd`, `rendering` and `solver` with the new version.
"""

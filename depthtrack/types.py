"""The array types that the modules share.

An alias states the element type. The shape, unit and frame stand in the docstring of what takes or returns the array.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Points, poses, matrices and every other result of double precision."""

Array32 = NDArray[np.float32]
"""Values that compiled code keeps in single precision."""

Depth = NDArray[np.float32]
"""A depth image (h, w) in metres, 0 where there is no measurement."""

Mask = NDArray[np.bool_]
"""True for the elements, mostly pixels, that belong to a set."""

Index = NDArray[np.int64]
"""Indices into another array, and integers that compiled code takes."""

Faces = NDArray[np.int64]
"""The vertex indices (F, 3) of triangles."""

Image = NDArray[np.uint8]
"""A colour image (h, w, 3), RGB, or one channel of it (h, w)."""

Labels = NDArray[np.uint8]
"""The class of each pixel."""

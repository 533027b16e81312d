"""The backdrop's boxes are those of trimesh, which takes long to import."""

import numpy as np
import trimesh

from depthtrack.synthesis import backdrop


def test_the_unit_box_is_that_of_trimesh() -> None:
    box = trimesh.creation.box()
    assert np.array_equal(box.vertices, backdrop._CORNERS - 0.5)
    assert np.array_equal(box.faces, backdrop._BOX_FACES)
    assert np.array_equal(box.face_normals, backdrop._BOX_NORMALS)
    assert np.array_equal(np.signbit(box.face_normals), np.signbit(backdrop._BOX_NORMALS))

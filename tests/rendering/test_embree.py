"""The renderers agree with rays cast by embree, a library that shares no code with them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from depthtrack.benchmarks.speed.tessellation import Tessellation
from depthtrack.geometry.camera import Camera
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import make_pose
from depthtrack.hand.primitives import Primitives
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.rendering.raycast import raycast
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.rendering.triangles import rasterise
from depthtrack.types import Array

pytest.importorskip("embreex", reason="embree is not installed: pip install 'depthtrack[embree]'")


def embree_depth(camera: Camera, vertices: Array, faces: NDArray[np.int64]) -> Array:
    """Return the depth (h, w), metres, of the nearest triangle at every pixel, 0 = no hit."""
    from trimesh import Trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    v, u = np.mgrid[: camera.height, : camera.width]
    rays = camera.unproject(np.stack([u.ravel(), v.ravel()], axis=-1), np.ones(u.size))
    caster = RayMeshIntersector(Trimesh(vertices, faces, process=False))
    places, hit, _ = caster.intersects_location(np.zeros_like(rays), rays, multiple_hits=False)
    depth = np.zeros(camera.shape)
    depth.ravel()[hit] = places[:, 2]
    return depth


def random_shape(rng: np.random.Generator) -> HandShape:
    default = HandShape()
    return default.with_(
        side="left" if rng.random() < 0.5 else "right",
        scale=rng.uniform(0.75, 1.25),
        lengths=default.lengths * rng.uniform(0.9, 1.1, (5, 3)),
        radii=default.radii * rng.uniform(0.92, 1.08, (5, 4)),
        palm_thickness=default.palm_thickness * rng.uniform(0.9, 1.1),
    )


def random_view(rng: np.random.Generator) -> tuple[Array, Camera]:
    """Return a random pose and a camera that shows most of the hand."""
    distance = rng.uniform(0.3, 1.0)
    pose = make_pose([*rng.uniform(-0.03, 0.03, 2), distance], rng.normal(size=4), rng.uniform(LOWER, UPPER))
    width, height = (int(n) for n in rng.integers(120, 320, 2))
    focal = rng.uniform(2, 4) * width * distance
    return pose, Camera(width, height, focal, focal * rng.uniform(0.9, 1.1), width / 2.1, height / 1.9)


@given(hand=st.integers(0, 3), seed=st.integers(0, 2**32 - 1))
@settings(max_examples=16)
def test_the_triangle_renderer_renders_the_skin_like_embree(hand: int, seed: int) -> None:
    pose, camera = random_view(np.random.default_rng(seed))
    shape = random_shape(np.random.default_rng(hand))  # a few hands only: their skins take time to make
    skin = Skin.of(shape)
    vertices = skin.vertices(HandModel(shape).transforms(pose))
    ours = rasterise(camera, vertices, skin.faces, skin.normals(vertices), skin.face_bodies).depth
    theirs = embree_depth(camera, vertices, skin.faces)
    seen, expected = ours > 0, theirs > 0
    assert np.count_nonzero(expected) > 200
    assert np.count_nonzero(seen != expected) <= 1e-3 * np.count_nonzero(expected)
    difference = np.abs(ours - theirs)[seen & expected]
    assert difference.max() < 1e-4
    # trimesh intersects the triangle that embree found once more, in float64.
    assert np.quantile(difference, 0.99) < 1e-9


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=6)
def test_the_ray_caster_renders_the_primitives_like_embree(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shape, (pose, camera) = random_shape(rng), random_view(rng)
    primitives, transforms = Primitives.of(shape), HandModel(shape).transforms(pose)
    surface = raycast(camera, primitives.kinds, primitives.transforms(transforms), primitives.bodies)
    mesh = Tessellation.of(primitives, subdivisions=5)
    theirs = embree_depth(camera, mesh.posed(transforms), mesh.faces)
    seen, expected = surface.depth > 0, theirs > 0
    common = seen & expected
    assert np.count_nonzero(common) > 200
    assert np.count_nonzero(seen != expected) <= 3e-3 * np.count_nonzero(expected)
    # Facets lie up to 20 micrometres inside the true surface, and never outside it.
    deeper = along_normal(camera, surface, theirs)[common]
    assert np.quantile(deeper, [0.005, 0.995]) == pytest.approx(1e-5, abs=1e-5)
    assert np.count_nonzero(np.abs(surface.depth - theirs)[common] > 1e-4) <= 5e-3 * np.count_nonzero(common)


def along_normal(camera: Camera, surface: RenderedSurface, depth: Array) -> Array:
    """Return how far (h, w) a depth map lies inside a surface, metres along its normal."""
    v, u = np.mgrid[: camera.height, : camera.width]
    rays = camera.unproject(np.stack([u, v], axis=-1), np.ones(camera.shape))
    return np.asarray(-np.sum(surface.normal * rays, axis=-1) * (depth - surface.depth))

"""Surface points of the primitives, compared with ray casting and the quadrics."""

import numpy as np
import pytest

from depthtrack.geometry.camera import Camera
from depthtrack.hand.compiled_kinematics import BodyPoses, Chain
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.primitives import SPHERE, Primitives
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.raycast import raycast
from depthtrack.solver.surface_points import SurfacePoints
from depthtrack.tracking.surfaces.primitives import INSIDE, inside_others, primitive_points, sample_primitive
from tests.support.surface_points import Posed, posed_points

SHAPES = {"average": HandShape(), "left, small": HandShape(side="left", scale=0.8)}


def implicit(kind: int, T: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return the quadric of a primitive at points (N, 3): 0 on the surface, positive outside."""
    unit = np.column_stack([x, np.ones(len(x))]) @ np.linalg.inv(T).T
    unit = unit[:, :3] / unit[:, 3:]
    return np.asarray((unit**2).sum(axis=1) - 1 if kind == SPHERE else (unit[:, :2] ** 2).sum(axis=1) - 1)


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
@pytest.mark.parametrize("posture", ["open", "fist"])
def test_hidden_points_lie_inside_another_primitive(shape: HandShape, posture: str) -> None:
    primitives = Primitives.of(shape)
    T = HandModel(shape).transforms(make_pose([0, 0, 0.5], [1, 0, 0, 0], POSTURES[posture]))
    owner = np.repeat(np.arange(len(primitives.kinds)), 40)
    local = np.concatenate(
        [sample_primitive(int(k), U)[0][::40] for k, U in zip(primitives.kinds, primitives.T_body_unit, strict=True)]
    )
    points = np.einsum("nij,nj->ni", T[primitives.bodies[owner]], np.column_stack([local, np.ones(len(local))]))
    wanted = np.zeros(len(local), np.bool_)
    for number, placed in enumerate(primitives.transforms(T)):
        x, y, z, w = np.linalg.inv(placed) @ points.T
        if primitives.kinds[number] == SPHERE:
            within = x * x + y * y + z * z < (INSIDE * w) ** 2
        else:
            within = (x * x + y * y < (INSIDE * w) ** 2) & (z * w > 0) & (z * w < w * w)
        wanted |= within & (owner != number)
    found = inside_others(primitives, T, local, owner)
    assert np.array_equal(found, wanted)
    assert 0 < found.sum() < len(found)


def test_samples_lie_on_the_primitives_with_outward_normals() -> None:
    primitives, step = Primitives.of(HandShape()), 1e-6
    for kind, T in zip(primitives.kinds, primitives.T_body_unit, strict=True):
        x, normals = sample_primitive(int(kind), T)
        assert np.abs(implicit(kind, T, x)).max() < 1e-9
        slopes = [
            (implicit(kind, T, x + step * axis) - implicit(kind, T, x - step * axis)) / (2 * step) for axis in np.eye(3)
        ]
        gradient = np.column_stack(slopes)
        gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
        np.testing.assert_allclose(normals, gradient, atol=1e-4)


def posed(points: SurfacePoints, shape: HandShape, pose: np.ndarray) -> Posed:
    return posed_points(points, BodyPoses.at(Chain.of(shape), pose))


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("posture", ["open", "grasp", "fist"])
def test_visible_points_lie_on_the_ray_cast_surface(name: str, posture: str) -> None:
    shape, camera = SHAPES[name], Camera(320, 240, 280.0, 280.0, 159.5, 119.5)
    pose = make_pose([0.01, 0.02, 0.45], [0.9, 0.2, 0.3, 0.1], POSTURES[posture])
    found, primitives = posed(primitive_points(shape, 0.026), shape, pose), Primitives.of(shape)
    T = primitives.transforms(HandModel(shape).transforms(pose))
    depth = raycast(camera, primitives.kinds, T, primitives.bodies).depth
    u, v = np.rint(camera.project(found.x)).astype(int).T
    drawn = depth[v, u]
    facing = np.einsum("vi,vi->v", found.n, found.x) / np.linalg.norm(found.x, axis=1) < -0.5
    gap = (found.x[:, 2] - drawn)[facing & (drawn > 0)]
    # No point lies before the drawn surface by more than the slope within a pixel. Most visible points lie on it.
    assert gap.min() > -0.004
    assert np.median(np.abs(gap[gap < 0.004])) < 0.0008

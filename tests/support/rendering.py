"""Random hands, imperfect observations of them, and the comparison of rasteriser and oracle."""

import numpy as np

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import make_pose
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.options import Objective
from depthtrack.rendering.oracle import OracleScorer
from depthtrack.rendering.raster import RasterScorer
from depthtrack.rendering.target import Target

OBJECTIVE = Objective()
KINECT = Camera(640, 480, 525.0, 525.0, 319.5, 239.5)


def random_shape(rng: np.random.Generator) -> HandShape:
    default = HandShape()
    return default.with_(
        side="left" if rng.random() < 0.5 else "right",
        scale=rng.uniform(0.7, 1.3),
        lengths=default.lengths * rng.uniform(0.85, 1.15, (5, 3)),
        radii=default.radii * rng.uniform(0.85, 1.15, (5, 4)),
        palm_breadth=default.palm_breadth * rng.uniform(0.9, 1.1),
        palm_thickness=default.palm_thickness * rng.uniform(0.8, 1.2),
    )


def random_poses(rng: np.random.Generator, count: int, centre: tuple[float, float, float], spread: float) -> np.ndarray:
    return make_pose(
        np.asarray(centre) + rng.uniform(-spread, spread, (count, 3)),
        rng.normal(size=(count, 4)),
        rng.uniform(LOWER, UPPER, (count, 20)),
    )


def target_of(shape: HandShape, pose: np.ndarray, camera: Camera, rng: np.random.Generator) -> Target:
    """Return an imperfect observation of a pose: holes in the depth, wrong silhouette labels."""
    empty = Target.blank(camera)
    oracle = OracleScorer(shape)
    oracle.set_target(empty)
    depth = oracle.render(pose)
    silhouette = (depth > 0) ^ (rng.random(camera.shape) < 0.02)
    return Target(camera, silhouette, np.where(rng.random(camera.shape) < 0.05, 0, depth).astype(np.float32))


def with_occluder(target: Target, distance: float, rng: np.random.Generator) -> Target:
    """Return the target with a slanted plane, about `distance` (m) away, over a part of it."""
    height, width = target.camera.shape
    v, u = np.mgrid[:height, :width]
    inside = (u - rng.uniform(0, width)) ** 2 + (v - rng.uniform(0, height)) ** 2 < (0.4 * max(height, width)) ** 2
    plane = distance + (u / width - 0.5) * rng.uniform(-0.1, 0.1) + (v / height - 0.5) * rng.uniform(-0.1, 0.1)
    free = ~inside
    return Target(target.camera, target.silhouette & free, target.depth * free, occluder=np.where(inside, plane, 0))


def with_surroundings(target: Target, distance: float, rng: np.random.Generator) -> Target:
    """Return the target with other readings over a part of it.

    They are of a slanted plane, about `distance` (m) away.
    """
    plane = with_occluder(Target.blank(target.camera), distance, rng).occluder
    assert plane is not None
    free = plane == 0
    maps = target.silhouette & free, target.depth * free
    return Target(target.camera, *maps, occluder=target.occluder, surroundings=plane)


def window_on(shape: HandShape, pose: np.ndarray, side: int) -> Camera:
    """A square region of the Kinect's image, `side` pixels wide, centred on the hand."""
    uv = KINECT.project(HandModel(shape).keypoints(pose)).mean(axis=0)
    return KINECT.crop(Rect.of_size(int(uv[0]) - side // 2, int(uv[1]) - side // 2, side, side))


def assert_agrees(shape: HandShape, target: Target, poses: np.ndarray, objective: Objective = OBJECTIVE) -> None:
    """Check depth to 0.1 mm, silhouettes to 0.1 % of their pixels and energies to 1e-3.

    The energies may differ more by the pixels whose match depends on the last bit of a depth.
    """
    fast, oracle = RasterScorer(shape, objective), OracleScorer(shape, objective)
    fast.set_target(target)
    oracle.set_target(target)
    terms, expected = fast.terms(poses), oracle.terms(poses)
    np.testing.assert_allclose(terms.kinematic, expected.kinematic, atol=1e-12)
    np.testing.assert_allclose(fast.score(poses), terms.energy, rtol=1e-12)
    for i, pose in enumerate(poses):
        ours, theirs = fast.render(pose), oracle.render(pose)
        drawn, truth = ours > 0, theirs > 0
        assert np.count_nonzero(drawn != truth) <= 1e-3 * np.count_nonzero(truth)
        assert np.abs(ours - theirs)[drawn & truth].max(initial=0) < 1e-4
        # One pixel that changes sides moves the silhouette term by about 2 lambda over the union's size.
        difference = np.abs(theirs - target.depth)
        undecided = np.count_nonzero(truth & (np.abs(difference - objective.match_depth) < 5e-6))
        undecided += np.count_nonzero(drawn != truth)
        if target.occluder is not None:
            behind = theirs - target.occluder - objective.hidden_depth
            undecided += np.count_nonzero(truth & (np.abs(behind) < 5e-6))
        if target.surroundings is not None:
            behind = theirs - target.surroundings - objective.surroundings_depth
            undecided += np.count_nonzero(truth & (np.abs(behind) < 5e-6))
        pixel = (2 * objective.silhouette_weight + objective.clamp_depth / objective.depth_unit) / (
            1 + np.count_nonzero(target.silhouette | truth)
        )
        assert abs(terms.energy[i] - expected.energy[i]) < 1e-3 + undecided * pixel

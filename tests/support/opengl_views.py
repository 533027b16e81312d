"""Comparisons of the OpenGL renderers with the oracle, in ordinary and in degenerate views.

They run in the tests' process for EGL and in a process of its own for OSMesa.
"""

import numpy as np

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.opengl.context import Platform
from depthtrack.rendering.opengl.scorer import OpenGLScorer, Sums
from depthtrack.rendering.options import Objective
from depthtrack.rendering.oracle import OracleScorer
from depthtrack.rendering.target import Target
from tests.support.rendering import KINECT, random_poses, random_shape, target_of, window_on, with_occluder

OBJECTIVE = Objective()
SMALL = Camera(64, 48, 60.0, 62.0, 31.0, 24.5)
BOTH_SUMS: tuple[Sums, Sums] = ("cpu", "gpu")
ABSURD = {
    "behind": ((0.0, 0.0, -0.6), 0.05),
    "around the lens": ((0.0, 0.0, 0.0), 0.08),
    "1 cm from the lens": ((0.0, 0.0, 0.01), 0.005),
    "reaching past the lens": ((0.0, 0.0, 0.1), 0.05),
    "at the border": ((0.24, 0.18, 0.5), 0.03),
    "outside": ((3.0, 0.0, 0.5), 0.1),
}


def assert_agrees(
    platform: Platform, shape: HandShape, target: Target, poses: np.ndarray, objective: Objective
) -> None:
    """Check depth to 0.1 mm, silhouettes to 0.1 % of their pixels and energies to 1e-3.

    The energies are compared where no match hangs on the last bits of a depth: such readings are taken out first.
    """
    oracle = OracleScorer(shape, objective)
    oracle.set_target(target)
    true = np.stack([oracle.render(pose) for pose in poses])
    margin = np.abs(np.abs(true - target.depth) - objective.match_depth)
    undecided = ((margin < 1e-5) & (true > 0)).any(axis=0)
    occluder = target.occluder
    if occluder is not None:
        near = np.abs(true - occluder - objective.hidden_depth) < 1e-5
        occluder = np.where((near & (true > 0)).any(axis=0), 0, occluder)
    target = Target(target.camera, target.silhouette, np.where(undecided, 0, target.depth), occluder=occluder)
    oracle.set_target(target)
    expected = oracle.terms(poses)
    for sums in BOTH_SUMS:
        with OpenGLScorer(shape, objective, platform, sums) as scorer:
            scorer.set_target(target)
            terms, drawn = scorer.terms(poses), np.stack([scorer.render(pose) for pose in poses])
        both, wrong = (drawn > 0) & (true > 0), (drawn > 0) != (true > 0)
        assert np.count_nonzero(wrong) <= 1e-3 * np.count_nonzero(true)
        assert np.abs(drawn - true)[both].max(initial=0) < 1e-4
        same = ~wrong.any(axis=(1, 2))
        np.testing.assert_allclose(terms.energy[same], expected.energy[same], atol=1e-3)
        np.testing.assert_allclose(terms.depth[same], expected.depth[same], atol=1e-3)
        np.testing.assert_allclose(terms.silhouette[same], expected.silhouette[same], atol=1e-6)
        np.testing.assert_allclose(terms.kinematic, expected.kinematic, atol=1e-12)


def assert_window_agrees(platform: Platform, seed: int, reduced: int | None) -> None:
    """A window on the hand half a metre away, native or reduced."""
    rng = np.random.default_rng(seed)
    shape, poses = random_shape(rng), random_poses(rng, 5, (0.02, -0.01, 0.5), 0.02)
    target = target_of(shape, poses[0], window_on(shape, poses[0], 224), rng)
    assert_agrees(platform, shape, target if reduced is None else target.reduced(reduced), poses, OBJECTIVE)


def assert_occluded_window_agrees(platform: Platform, seed: int, before_cost: float) -> None:
    """A window on a hand that an object hides in part."""
    rng = np.random.default_rng(seed)
    shape, poses = random_shape(rng), random_poses(rng, 5, (0.02, -0.01, 0.5), 0.02)
    target = with_occluder(target_of(shape, poses[0], window_on(shape, poses[0], 224), rng), 0.5, rng)
    assert_agrees(platform, shape, target, poses, Objective(before_cost=before_cost))


def assert_any_camera_agrees(platform: Platform, seed: int) -> None:
    """Check any image size, field of view and principal point, with hands near, far and cut off."""
    rng = np.random.default_rng(seed)
    width, height = (int(n) for n in rng.integers(1, 200, 2))
    focal = rng.uniform(0.5, 2) * max(width, height)
    camera = Camera(width, height, focal, focal * rng.uniform(0.8, 1.2), *rng.uniform(-0.5, 1.5, 2) * [width, height])
    shape, poses = random_shape(rng), random_poses(rng, 4, (0, 0, rng.uniform(0.1, 2.5)), 0.2)
    assert_agrees(platform, shape, target_of(shape, poses[0], camera, rng), poses, Objective(0.015, 0.06, 5.0, 2.0))


def assert_absurd_view_agrees(platform: Platform, name: str, seed: int) -> None:
    """Check degenerate views; a hand behind the lens or outside the image must not show."""
    rng, (centre, spread) = np.random.default_rng(seed), ABSURD[name]
    camera = KINECT.resized(0.25)
    shape, poses = random_shape(rng), random_poses(rng, 6, centre, spread)
    target = target_of(shape, random_poses(rng, 1, (0, 0, 0.4), 0)[0], camera, rng)
    assert_agrees(platform, shape, target, poses, OBJECTIVE)
    if name in ("behind", "outside"):
        with OpenGLScorer(shape, platform=platform) as scorer:
            scorer.set_target(target)
            assert not any(scorer.render(pose).any() for pose in poses)


def assert_overhanging_windows_agree(platform: Platform) -> None:
    """A window that hangs over the image's corner, and one larger than the image."""
    rng = np.random.default_rng(7)
    shape, poses = HandShape(), random_poses(rng, 6, (0.25, 0.2, 0.5), 0.02)
    full = target_of(shape, poses[0], KINECT.resized(0.5), rng)
    for left, top, width, height in ((250, 190, 150, 150), (-40, -30, 400, 300), (-200, -200, 64, 64)):
        assert_agrees(platform, shape, full.crop(Rect.of_size(left, top, width, height)), poses, OBJECTIVE)


def energies_and_depth(platform: Platform, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Of a batch around one observation, for comparing platforms bit by bit."""
    rng = np.random.default_rng(seed)
    shape, poses = random_shape(rng), random_poses(rng, 20, (0, 0, 0.5), 0.02)
    target = target_of(shape, poses[0], window_on(shape, poses[0], 224), rng).reduced(64)
    with OpenGLScorer(shape, platform=platform) as scorer:
        scorer.set_target(target)
        return scorer.score(poses), scorer.render(poses[1])


def scene(seed: int = 0) -> tuple[Target, np.ndarray]:
    """Return noise as an observation, and poses (9, 27) to score against it."""
    rng = np.random.default_rng(seed)
    depth = rng.uniform(0.3, 0.5, SMALL.shape).astype(np.float32)
    return Target(SMALL, rng.random(SMALL.shape) < 0.5, depth), random_poses(rng, 9, (0, 0, 0.4), 0.05)

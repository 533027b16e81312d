"""The prior of a fit on the finger angles."""

from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.hand.pose import ANGLES, make_pose
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.options import ScoringOptions
from depthtrack.solver.options import IcpOptions, SurfaceFitOptions
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.tracking.frame import FrameContext, Toolkit
from depthtrack.tracking.options import TrackingThresholds
from depthtrack.tracking.posture_prior import for_hand, posture_prior, prior_near
from depthtrack.tracking.state import TrackState
from tests.support.observations import observe

FLAT = np.zeros(20)
FINGERS = [slice(4 * finger, 4 * finger + 4) for finger in range(5)]


def test_the_prior_keeps_a_share_of_the_distance_from_the_mean_posture() -> None:
    mean, options = posture_prior().mean, IcpOptions(posture_weight=1e-4)
    assert prior_near(FLAT, 1.0, options).mean == pytest.approx(FLAT, abs=1e-12)
    assert prior_near(FLAT, 0.0, options).mean == pytest.approx(mean)
    assert prior_near(FLAT, 0.25, options).mean == pytest.approx(0.75 * mean)


def test_a_hidden_finger_follows_its_neighbours() -> None:
    """The likeliest ring finger bends with a middle and a little finger that are measured bent."""
    prior = prior_near(FLAT, 1.0, IcpOptions(posture_weight=1e-4))
    measured = np.zeros(20, dtype=np.bool_)
    measured[FINGERS[2]], measured[FINGERS[4]] = True, True
    bent = np.where(np.arange(20) % 4 > 0, 0.6, 0.0)
    hidden = ~measured
    moved = -np.linalg.solve(prior.precision[np.ix_(hidden, hidden)], prior.precision[np.ix_(hidden, measured)])
    angles = np.zeros(20)
    angles[hidden] = moved @ bent[measured]
    assert angles[FINGERS[3]][1:].mean() > 0.3


def test_without_a_weight_each_angle_is_held_alone() -> None:
    options = IcpOptions()
    prior = prior_near(FLAT, 0.3, options)
    np.testing.assert_array_equal(prior.precision, options.temporal_weight * np.eye(20))
    np.testing.assert_array_equal(prior.mean, FLAT)


def test_a_posture_is_forgotten_over_time() -> None:
    made, options = Synthesiser(Synthesis()), IcpOptions(posture_memory=2.0, search_share=0.4)
    state = TrackState(TrackingThresholds(), 40.0)
    with closing(Toolkit(HandShape(), ScoringOptions())) as tools:
        frame = FrameContext(replace(observe(made, 0), timestamp=5.0), tools, state, 0)
        assert frame.posture_kept(options) == 0.4
        state.pose, state.time = make_pose(np.array([0, 0, 0.5]), np.array([1.0, 0, 0, 0]), FLAT), 4.0
        assert frame.posture_kept(options) == pytest.approx(np.exp(-0.5))


@pytest.mark.parametrize("wrong", [{"posture_weight": -1.0}, {"posture_memory": 0.0}, {"search_share": 1.5}])
def test_values_out_of_range_are_rejected(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match=f"{next(iter(wrong))} must be from"):
        IcpOptions(**wrong)  # type: ignore[arg-type]


def test_visible_fingers_are_hardly_moved() -> None:
    """A pose at the truth stays there, though the prior is far away."""
    made = Synthesiser(Synthesis())
    pose = made.poses[0]
    with closing(Toolkit(HandShape(), ScoringOptions())) as tools:
        fitter = tools.fitter(SurfaceFitOptions(surface="primitives"), observe(made, 0))
        free, held = (
            fitter.fit(pose, prior=prior_near(posture_prior().mean, 1.0, IcpOptions(posture_weight=weight)))
            for weight in (1e-9, 1e-4)
        )
    keypoints = tools.model.keypoints(np.stack([free, held]))
    assert np.median(np.linalg.norm(keypoints[0] - keypoints[1], axis=1)) < 0.001
    assert np.isfinite(held[ANGLES]).all()


@pytest.mark.parametrize(("uncertainty", "share"), [(0.0, 1 / 3), (0.002, 0.5), (0.004, 1.0), (0.02, 1.0)])
def test_points_count_more_beside_the_prior_for_exact_sizes(uncertainty: float, share: float) -> None:
    options = SurfaceFitOptions(icp=IcpOptions(posture_weight=3e-4, keypoint_weight=0.3))
    found = for_hand(options, HandShape(uncertainty=uncertainty))
    assert found.icp.posture_weight == pytest.approx(3e-4 * share)
    assert found.icp.keypoint_weight == pytest.approx(0.3 * share)
    without = SurfaceFitOptions()
    assert for_hand(without, HandShape(uncertainty=uncertainty)) == without

"""Test observations of synthetic recordings: regions, noise, caching."""

from typing import Any

import numpy as np
import pytest

from depthtrack.rendering.oracle import OracleScorer
from depthtrack.segmentation.options import RoiOptions
from depthtrack.synthesis import observations
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.synthesis.observations import observation_of, observed_motion


@pytest.mark.parametrize("recording", [Synthesis(frames=30), Synthesis(frames=30, distance=2.0, viewpoint=5)])
def test_an_observed_motion_shows_the_true_hand_with_a_margin(recording: Synthesis) -> None:
    motion, oracle = observed_motion(recording), OracleScorer(recording.hand)
    for index in (0, 29):
        observation = motion[index]
        oracle.set_target(observation)
        expected = oracle.render(motion.poses[index])
        np.testing.assert_array_equal(observation.silhouette, expected > 0)
        np.testing.assert_allclose(observation.depth, expected, atol=2e-4)
        assert oracle.score(motion.poses[[index]])[0] < 0.5
        rows, columns = np.nonzero(observation.silhouette)
        height, width = observation.silhouette.shape
        pixel = np.median(expected[expected > 0]) / observation.camera.fx
        for margin in (rows.min(), columns.min(), height - 1 - rows.max(), width - 1 - columns.max()):
            assert margin * pixel == pytest.approx(RoiOptions().margin, rel=0.05)
        assert np.linalg.norm(observation.centre - motion.poses[index, :3]) < 0.06


def test_an_observed_motion_has_the_requested_noise() -> None:
    clean, noisy = (
        observed_motion(Synthesis(frames=1))[0],
        observed_motion(Synthesis(frames=1, depth_noise=0.02, skin_flips=0.3))[0],
    )
    assert noisy.camera == clean.camera
    error = (noisy.depth - clean.depth)[clean.depth > 0]
    assert error.std() == pytest.approx(0.02, rel=0.05)
    assert np.mean(noisy.silhouette != clean.silhouette) == pytest.approx(0.3, rel=0.05)


def test_each_frame_is_made_once_and_few_motions_are_cached(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[int] = []

    def counted(frame: Any, source: Synthesiser, index: int) -> Any:
        made.append(index)
        return observation_of(frame, source, index)

    monkeypatch.setattr(observations, "observation_of", counted)
    recording = Synthesis(frames=2, seed=77)
    for _ in range(3):
        assert observed_motion(recording)[1] is observed_motion(recording)[1]
    assert made == [1]
    for seed in range(observations.MOTIONS_KEPT):
        observed_motion(Synthesis(frames=2, seed=78 + seed))
    observed_motion(recording)[1]
    assert made == [1, 1]

"""The baselines: spline, rigid pattern, principal components."""

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.markers.filled_capture import Filling, Gap
from depthtrack.markers.filling.fill import fill_gaps
from depthtrack.markers.filling.options import FillOptions, PcaFillOptions
from depthtrack.markers.filling.pattern_fill import pattern_fill
from depthtrack.markers.filling.pca_fill import pca_fill
from depthtrack.markers.filling.spline_fill import spline_fill
from depthtrack.options import from_data, to_data
from depthtrack.types import Array
from tests.markers.filling.captures import cut, hand, labelled, poses

GAP = Gap(0, 0, 30, 50)


def cubic(frames: int = 80) -> Array:
    t = np.arange(frames) / frames
    return np.stack([t**3 - t, 2 * t**2, 1 - t], axis=-1)[:, None]


def test_a_spline_reproduces_a_cubic() -> None:
    track = cubic()
    given = track.copy()
    given[30:50] = np.nan
    np.testing.assert_allclose(spline_fill(given, [GAP])[30:50], track[30:50], atol=1e-9)


def test_a_pattern_is_exact_on_a_rigid_body() -> None:
    rigid = poses(80).copy()
    rigid[:, 7:] = rigid[0, 7:]
    whole = hand().positions(rigid)
    given = whole.copy()
    given[30:50, 0] = np.nan
    filled = pattern_fill(given, [GAP], FillOptions().pattern)
    np.testing.assert_allclose(filled[30:50, 0], whole[30:50, 0], atol=1e-9)


@pytest.mark.parametrize("strategy", ["R1", "R2"])
def test_principal_components_reproduce_linear_motion(strategy: str) -> None:
    generator = np.random.default_rng(0)
    scores, axes = np.cumsum(generator.normal(size=(300, 2)), axis=0), generator.normal(size=(2, 30))
    whole = (scores @ axes).reshape(300, 10, 3) * 0.01 + generator.normal(0, 0.05, (10, 3))
    given = whole.copy()
    given[30:50, 0] = np.nan
    given[35:45, 1] = np.nan
    options = PcaFillOptions(strategy=strategy, variance_share=0.999999)  # type: ignore[arg-type]
    filled = pca_fill(given, [GAP, Gap(0, 1, 35, 45)], options)
    for m, rows in ((0, slice(30, 50)), (1, slice(35, 45))):
        spread = np.linalg.norm(whole[:, m] - whole[:, m].mean(axis=0), axis=-1).mean()
        assert np.linalg.norm(filled[rows, m] - whole[rows, m], axis=-1).max() < 0.1 * spread


def test_principal_components_use_other_labelled_trajectories() -> None:
    whole = hand().positions(poses())
    double = whole[:, [3]] + 0.05
    given = cut(whole, ("thumb_tip", 100, 150))
    alone = fill_gaps(labelled(given, poses()), FillOptions(method="pca")).positions[0][100:150, 3]
    helped = fill_gaps(labelled(given, poses(), others=double), FillOptions(method="pca")).positions[0][100:150, 3]
    error = [np.linalg.norm(found - whole[100:150, 3], axis=-1).mean() for found in (alone, helped)]
    assert error[1] < error[0]


@pytest.mark.parametrize(
    ("method", "how"), [("spline", Filling.SPLINE), ("pattern", Filling.PATTERN), ("pca", Filling.PCA)]
)
def test_samples_are_marked(method: str, how: Filling) -> None:
    given = labelled(cut(hand().positions(poses()), ("thumb_tip", 100, 150)), poses())
    filled = fill_gaps(given, FillOptions(method=method))  # type: ignore[arg-type]
    assert (filled.how[0][100:150, 3] == how).all()
    assert (np.diff(filled.expected_error[0][100:125, 3]) > 0).all()


def test_options_survive_json() -> None:
    options = FillOptions(method="pca", longest=3.0, pca=PcaFillOptions(strategy="R1"))
    assert from_data(FillOptions, to_data(options), "options") == options


def test_a_gap_length_of_zero_is_refused() -> None:
    with pytest.raises(InputError, match="longest must be from"):
        FillOptions(longest=0)

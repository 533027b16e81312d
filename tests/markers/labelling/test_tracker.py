"""Online labelling: whole hands, missing markers, ghosts, the paper's configuration."""

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from depthtrack.errors import InputError
from depthtrack.markers.labelling.assignment import assign
from depthtrack.markers.labelling.options import PAPER_LABELLING, AssignmentOptions, LabellingOptions
from depthtrack.markers.labelling.prediction import mahalanobis, predict
from depthtrack.markers.labelling.scene import Scene
from depthtrack.markers.labelling.state import FrameLabels, Settings, TrackState
from depthtrack.markers.labelling.tracker import MarkerTracker
from depthtrack.options import from_data, to_data
from tests.markers.labelling.examples import CLEAN, USUAL, Example, example


@pytest.fixture(scope="module")
def usual() -> Example:
    return example(300, USUAL)


def track(made: Example, options: LabellingOptions | None = None) -> tuple[np.ndarray, ...]:
    tracker = MarkerTracker(made.models, made.capture.rate, options, made.starts)
    columns = [np.full(c.shape, -1, np.int64) for c in made.columns]
    for t in range(len(made.capture)):
        points, numbers = made.capture.points(t)
        for k, chosen in enumerate(tracker.update(points).points):
            columns[k][t] = np.where(chosen >= 0, numbers[chosen], -1)
    return tuple(columns)


@pytest.mark.parametrize("options", [LabellingOptions(), PAPER_LABELLING])
def test_clean_captures_are_labelled_without_an_error(options: LabellingOptions) -> None:
    made = example(150, CLEAN)
    assert made.right(track(made, options)) == 1.0


def test_two_hands_and_rigid_bodies_are_tracked_together() -> None:
    made = example(100, CLEAN, layout="13", two_hands=True, rigid_bodies=2, rigid_markers=3)
    assert made.right(track(made)) == 1.0


def test_ghosts_and_dropouts_cost_few_labels(usual: Example) -> None:
    assert made_share(usual, LabellingOptions()) > 0.99


def test_the_default_labels_more_than_the_paper(usual: Example) -> None:
    assert made_share(usual, LabellingOptions()) > made_share(usual, PAPER_LABELLING) > 0.8


def made_share(made: Example, options: LabellingOptions) -> float:
    return made.right(track(made, options))


def test_poses_follow_the_truth() -> None:
    made = example(80, CLEAN)
    tracker = MarkerTracker(made.models, made.capture.rate, starts=made.starts)
    poses = np.stack([tracker.update(made.capture.points(t)[0]).poses[0] for t in range(80)])
    assert np.degrees(np.abs(poses[:, 7:] - made.poses[0][:, 7:])).mean() < 2.0
    assert np.abs(poses[:, :3] - made.poses[0][:, :3]).max() < 0.002


def test_a_frame_without_points_keeps_the_pose() -> None:
    made = example(20, CLEAN)
    tracker = MarkerTracker(made.models, made.capture.rate, starts=made.starts)
    for t in range(10):
        last = tracker.update(made.capture.points(t)[0])
    empty = tracker.update(np.empty((0, 3)))
    assert np.all(empty.points[0] == -1)
    np.testing.assert_allclose(empty.poses[0, 7:], last.poses[0, 7:], atol=0.02)


def test_a_model_without_points_is_lost_and_starts_again() -> None:
    made = example(60, CLEAN)
    starts = list(made.starts)
    tracker = MarkerTracker(made.models, 10.0, starts=starts, starter=lambda points, models: (None,))
    for _ in range(3):
        frame = tracker.update(np.empty((0, 3)))
    assert not tracker.is_tracked.any()
    assert np.isnan(frame.poses).all()
    again = MarkerTracker(made.models, made.capture.rate, starter=lambda points, models: (starts[0],))
    assert again.update(made.capture.points(0)[0]).points[0].min() >= 0


def test_a_ghost_near_a_missing_marker_is_rejected_by_the_model() -> None:
    made = example(40, CLEAN)
    tracker = MarkerTracker(made.models, made.capture.rate, starts=made.starts)
    marker = made.models[0].labels.index("middle_knuckle")
    for t in range(39):
        points, numbers = made.capture.points(t)
        hidden = numbers == made.columns[0][t, marker]
        if t > 20:
            points[hidden] += [0.014, 0.0, 0.014]
        frame = tracker.update(points)
    assert frame.points[0][marker] == -1


def test_the_assignment_is_that_of_the_oracle(usual: Example) -> None:
    scene, settings = Scene.of(usual.models), Settings.of(LabellingOptions(), usual.capture.rate)
    state, out = TrackState.empty(scene), FrameLabels.empty(26)
    state.start(scene, 0, usual.poses[0][100])
    state.missing[:] = np.arange(26) % 7 * 40
    state.undetermined[0] = 30
    state.step[0, :3] = 0.004
    points = usual.capture.points(100)[0]
    predict(scene, settings, state, np.empty((1, 27)), np.empty((26, 3)), out)
    out.expected[state.missing == 0] += 0.004
    assign(points, scene, settings, state, out)
    score = np.zeros((26, len(points) + 26))
    for i in range(26):
        odds = settings.seen_again if state.missing[i] == 0 else settings.reappears
        for j, point in enumerate(points):
            score[i, j] = odds - settings.clutter + out.peak[i]
            score[i, j] -= 0.5 * mahalanobis(out.precision[i], out.expected[i], point)
    rows, columns = linear_sum_assignment(-np.where(score > 0, score, 0.0))
    best = np.where(score > 0, score, 0.0)[rows, columns].sum()
    assert np.nansum(out.score) == pytest.approx(best)
    assert len(set(out.point[out.point >= 0])) == np.count_nonzero(out.point >= 0)


def test_options_survive_json_and_reject_nonsense() -> None:
    assert from_data(LabellingOptions, to_data(PAPER_LABELLING), "options") == PAPER_LABELLING
    with pytest.raises(InputError, match="seen_again must be from 0 to 1"):
        LabellingOptions(assignment=AssignmentOptions(seen_again=1.5))

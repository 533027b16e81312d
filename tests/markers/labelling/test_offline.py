"""Offline labelling: tracklets, evidence, and whole captures."""

import numpy as np
import pytest

from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.labelling.capture_fit import ExpectedFrames
from depthtrack.markers.labelling.evidence import assign_tracklets
from depthtrack.markers.labelling.offline import label_capture
from depthtrack.markers.labelling.options import PAPER_LABELLING, LabellingOptions
from depthtrack.markers.labelling.packed import PackedPoints
from depthtrack.markers.labelling.splitting import split_tracklets
from depthtrack.markers.labelling.state import Settings
from depthtrack.markers.labelling.tracklets import LinkSettings, make_tracklets
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array
from tests.markers.labelling.examples import USUAL, Example, example

LINKS = LinkSettings.of(LabellingOptions(), 100.0)


def crossing(gap: float) -> PackedPoints:
    """Return two points that pass each other at a distance, metres, at 1 m/s."""
    x = np.arange(-30, 31) * 0.01
    tracks = np.stack([np.stack([x, 0 * x, 0 * x], axis=-1), np.stack([-x, 0 * x + gap, 0 * x], axis=-1)], axis=1)
    return PackedPoints.of(MarkerCapture(100.0, ("*1", "*2"), tracks))


def test_tracklets_are_cut_where_points_cannot_be_told_apart() -> None:
    wide, narrow = crossing(0.05), crossing(0.001)
    assert make_tracklets(wide, LINKS).max() == 1
    tracklet = make_tracklets(narrow, LINKS)
    assert tracklet.max() > 1
    for k in range(tracklet.max() + 1):
        assert len(set(narrow.column[tracklet == k])) == 1


def test_tracklets_of_a_capture_never_mix_markers() -> None:
    made = example(300, USUAL)
    points = PackedPoints.of(made.capture)
    tracklet = make_tracklets(points, LinkSettings.of(LabellingOptions(), made.capture.rate))
    truth = np.full(made.capture.positions.shape[:2], -1)
    for t, columns in enumerate(made.columns[0]):
        truth[t, columns[columns >= 0]] = np.flatnonzero(columns >= 0)
    marker = truth[points.frame, points.column]
    for k in range(tracklet.max() + 1):
        assert len(set(marker[tracklet == k])) == 1


def test_no_marker_takes_two_points_in_a_frame() -> None:
    frame = np.repeat(np.arange(4), 2)
    points = PackedPoints(np.zeros((8, 3)), np.arange(0, 10, 2), frame, np.tile([0, 1], 4))
    tracklet = np.tile([0, 1], 4)
    chosen = assign_tracklets(points, tracklet, np.array([[40.0, 36.0], [38.0, -80.0]]))
    assert chosen.tolist() == [1, 0]


@pytest.fixture(scope="module")
def made() -> Example:
    return example(400, USUAL)


def test_a_whole_capture_is_labelled(made: Example) -> None:
    labelled = label_capture(made.capture, made.models, starts=made.starts)
    assert made.right(labelled.columns) > 0.995
    assert np.isfinite(labelled.poses[0]).all()
    held = labelled.columns[0] >= 0
    assert np.array_equal(np.isfinite(labelled.confidence[0]), held)
    for row in labelled.columns[0]:
        assert len(set(row[row >= 0])) == np.count_nonzero(row >= 0)


def test_the_paper_labels_online_alone(made: Example) -> None:
    paper = label_capture(made.capture, made.models, PAPER_LABELLING, made.starts)
    assert 0.7 < made.right(paper.columns) < 0.995


def test_without_a_start_nothing_is_labelled(made: Example) -> None:
    labelled = label_capture(made.capture, made.models, starts=[None])
    assert np.all(labelled.columns[0] == -1)
    assert np.isnan(labelled.poses[0]).all()


def test_a_tracklet_of_two_markers_is_cut() -> None:
    frames, place = np.arange(60), np.array([[0.0, 0, 0], [0.01, 0, 0]])
    position = place[(frames >= 40).astype(int)]
    points = PackedPoints(position, np.arange(61), frames, np.zeros(60, np.int64))
    expected = ExpectedFrames(
        np.tile(place, (60, 1, 1)), np.tile(np.eye(3) * 1e6, (60, 2, 1, 1)), np.full((60, 2), 17.0)
    )
    settings = Settings.of(LabellingOptions(), 100.0)
    cut = split_tracklets(points, np.zeros(60, np.int64), expected, settings, 60.0)
    assert cut.tolist() == [0] * 40 + [1] * 20


def test_confidence_is_higher_where_labels_are_right(made: Example) -> None:
    labelled = label_capture(made.capture, made.models, starts=made.starts)
    right, sure = labelled.columns[0] == made.columns[0], labelled.confidence[0]
    given = labelled.columns[0] >= 0
    assert sure[given & right].mean() > 0.99
    assert given[~right].sum() == 0 or sure[given & ~right].mean() < sure[given & right].mean()


def test_a_start_in_the_middle_labels_both_sides(made: Example) -> None:
    starts = [poses[200] for poses in made.poses]
    labelled = label_capture(made.capture, made.models, starts=starts, frame=200)
    assert made.right(labelled.columns) > 0.995
    online = label_capture(made.capture, made.models, PAPER_LABELLING, starts, frame=200)
    assert online.columns[0][:200].max() >= 0


def test_a_lost_model_starts_again_in_a_later_frame(made: Example) -> None:
    calls = list[int]()

    def starter(points: Array, models: tuple[MarkerModel, ...]) -> tuple[Array | None, ...]:
        calls.append(len(points))
        return (made.poses[0][100],) if len(calls) > 3 else (None,)

    labelled = label_capture(made.capture.between(100, 200), made.models, starter=starter)
    assert np.isfinite(labelled.poses[0]).all()
    assert 3 < len(calls) < 20

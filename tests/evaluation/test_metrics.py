"""Test each metric on a case computed by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.evaluation.metrics import (
    Metric,
    PointErrors,
    Reliability,
    SuccessCurve,
    added_jitter,
    angle_error,
    e2d,
    e3d,
    endpoint_errors,
    find_losses,
    frame_time,
    jitter,
    joint_errors,
    silhouette_iou,
    stage_times,
)
from depthtrack.evaluation.metrics.success import LIMIT_MM
from depthtrack.hand.kinematics import ENDPOINT_NAMES, KEYPOINT_NAMES, HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.hand.shape import HandShape
from depthtrack.recording.status import Status

MODEL = HandModel(HandShape())
POSE = make_pose([0, 0, 0.5], [0, 1, 0, 0], np.full(20, 0.1))
NOWHERE = np.full(27, np.nan)
NAMES = ("thumb_tip", "index_tip")


def errors_of(largest: list[float]) -> PointErrors:
    """Return errors of two points, the second exact; NaN is a frame without a pose."""
    mm = np.array([[e, 0.0 if math.isfinite(e) else np.nan] for e in largest])
    return PointErrors("endpoint_error_mm", NAMES, mm, np.ones(len(largest), dtype=np.bool_))


def test_statistics_leave_out_frames_without_a_value() -> None:
    values = np.array([np.nan, *range(101)], dtype=np.float64)
    assert Metric("m_mm", "mm", values).statistics() == {"mean": 50, "median": 50, "p95": 95, "max": 100}
    better = Metric("iou", "", values, higher_is_better=True).statistics()
    assert better == {"mean": 50, "median": 50, "p05": 5, "min": 0}
    assert set(Metric("m_mm", "mm", np.full(3, np.nan)).statistics().values()) == {None}


# Errors of points and angles


def test_endpoint_errors_of_a_hand_moved_by_3_and_4_mm() -> None:
    moved = POSE + np.array([0.003, 0.004, *np.zeros(25)])
    errors = endpoint_errors(MODEL, np.array([moved, POSE, NOWHERE]), MODEL, np.array([POSE, POSE, POSE]))
    np.testing.assert_allclose(errors.mm[:2], np.repeat([[5.0], [0.0]], 20, axis=1), atol=1e-9)
    np.testing.assert_allclose(errors.mean().values, [5, 0, np.nan], atol=1e-9)
    assert errors.mean().name == "endpoint_error_mm"
    assert errors.known.all()
    assert errors.names == ENDPOINT_NAMES


def test_each_finger_has_its_own_error() -> None:
    bent = POSE.copy()
    bent[7 + 4 * 1 + 3] += 0.2  # the last joint of the index finger moves its tip only
    errors = endpoint_errors(MODEL, bent[None], MODEL, POSE[None])
    length = MODEL.lengths[1, 2]
    chord_mm = 1000 * 2 * length * math.sin(0.1)
    assert errors.largest().values[0] == pytest.approx(chord_mm)
    assert errors.of_finger("index").values[0] == pytest.approx(chord_mm / 4)
    assert errors.mean().values[0] == pytest.approx(chord_mm / 20)
    assert [metric.values[0] for metric in errors.by_finger().values()] == pytest.approx([0, chord_mm / 4, 0, 0, 0])


def test_joints_of_another_skeleton_are_compared_by_name() -> None:
    names = ("little_tip", "wrist", "thumb_ip")
    keypoints = MODEL.keypoints(POSE)
    joints = np.array([keypoints[KEYPOINT_NAMES.index(name)] for name in names])
    joints[0, 2] += 0.012
    joints[2] = np.nan  # not annotated in this frame
    errors = joint_errors(MODEL, np.array([POSE, POSE]), np.array([joints, np.full((3, 3), np.nan)]), names)
    np.testing.assert_allclose(errors.mm[0], [12, 0, np.nan], atol=1e-9)
    np.testing.assert_allclose(errors.mean().values, [6, np.nan], atol=1e-9)
    assert errors.mean().name == "joint_error_mm"
    assert errors.known.tolist() == [True, False]
    assert errors.of_finger("little").values[0] == pytest.approx(12)
    assert np.isnan(errors.of_finger("middle").values).all()


def test_angles_are_compared_in_degrees() -> None:
    turned = POSE.copy()
    turned[7:17] += math.radians(4)
    turned[3:7] = [1, 0, 0, 0]  # the orientation of the palm is no finger angle
    metric = angle_error(np.array([turned, POSE]), np.array([POSE, NOWHERE]))
    np.testing.assert_allclose(metric.values, [2, np.nan])
    assert metric.unit == "deg"


# Share of frames


def test_shares_of_frames_by_hand() -> None:
    curve = SuccessCurve.of(errors_of([5, 15, 15, 35, math.nan]))
    assert curve is not None
    assert [curve.within(mm) for mm in (5, 10, 20, 30, 40)] == [0, 0.2, 0.6, 0.6, 0.8]
    assert curve.frames == 5
    assert curve.auc == pytest.approx((45 + 35 + 35 + 15 + 0) / 50 / 5)
    assert curve.to_json()["frames_within_mm"] == {"10": 0.2, "20": 0.6, "30": 0.6, "40": 0.8}


@given(st.lists(st.floats(0, 120), min_size=1, max_size=30))
def test_the_area_is_that_under_the_curve(errors: list[float]) -> None:
    curve = SuccessCurve.of(errors_of(errors))
    assert curve is not None
    fine = np.linspace(0, LIMIT_MM, 20001)
    area = np.mean([curve.within(threshold) for threshold in fine])
    assert curve.auc == pytest.approx(area, abs=2e-3)
    assert np.all(np.diff(curve.shares) >= 0)


def test_a_track_without_ground_truth_has_no_curve() -> None:
    nothing = PointErrors("joint_error_mm", NAMES, np.full((3, 2), np.nan), np.zeros(3, dtype=np.bool_))
    assert SuccessCurve.of(nothing) is None


# Losses


def test_losses_and_the_time_to_recovery() -> None:
    first = ["absent", "absent", "started", "tracked"]
    status = [*first, "lost", "lost", "started", "tracked", "absent", "tracked", "lost"]
    times = np.arange(11) / 10
    losses = find_losses([Status(each) for each in status], times)
    assert losses.first_trusted == 2
    assert [(loss.first, loss.frames, loss.seen) for loss in losses.losses] == [
        (4, 2, True),
        (8, 1, False),
        (10, 1, True),
    ]
    assert losses.losses[0].seconds == pytest.approx(0.3)
    assert losses.losses[1].seconds == pytest.approx(0.2)
    assert losses.losses[2].seconds is None
    assert losses.recovered == 2
    report = losses.to_json()
    assert (report["lost_frames"], report["absent_frames"], report["losses"], report["recovered"]) == (3, 3, 3, 2)
    assert report["time_to_recovery_s"]["mean"] == pytest.approx(0.25)
    assert report["time_to_recovery_s"]["max"] == pytest.approx(0.3)


@pytest.mark.parametrize("status", [[], ["absent", "lost"], ["started", "tracked"]])
def test_a_track_without_loss_or_without_start_has_no_losses(status: list[str]) -> None:
    losses = find_losses([Status(each) for each in status], np.arange(len(status), dtype=np.float64))
    assert losses.losses == ()
    assert losses.time_to_recovery().statistics()["mean"] is None


# Jitter


def line(times: np.ndarray) -> np.ndarray:
    """Return two points (T, 2, 3) that move at constant velocity."""
    return np.array([[[0.1 * t, 0.0, 0.5], [0.0, -0.3 * t, 0.6]] for t in times])


def test_constant_velocity_has_no_jitter_at_uneven_times() -> None:
    times = np.array([0, 0.033, 0.07, 0.1, 0.133])
    metric = jitter(line(times), times)
    assert np.isnan(metric.values[[0, -1]]).all()
    np.testing.assert_allclose(metric.values[1:-1], 0, atol=1e-9)


def test_one_point_that_jumps_by_6_mm() -> None:
    times = np.arange(5) / 30
    points = line(times)
    points[2, 0, 2] += 0.006
    # One of the two points is 6 mm from its line, and shifts the lines of its neighbours by 3 mm.
    np.testing.assert_allclose(jitter(points, times).values[1:-1], [1.5, 3, 1.5], atol=1e-9)
    np.testing.assert_allclose(added_jitter(points, line(times), times).values[1:-1], [1.5, 3, 1.5], atol=1e-9)


def test_acceleration_and_noise_give_the_documented_jitter() -> None:
    times = np.arange(4000) / 30
    fall = np.zeros((4000, 1, 3))
    fall[:, 0, 1] = 5.0 / 2 * times**2
    assert jitter(fall, times).statistics()["median"] == pytest.approx(5.0 / 2 / 30**2 * 1000)
    assert np.nanmax(added_jitter(fall, fall, times).values) == 0
    noise = np.random.default_rng(0).normal(0, 0.001, (4000, 20, 3))
    assert np.nanmean(jitter(noise, times).values) == pytest.approx(1.95, rel=0.01)


def test_jitter_is_nan_beside_a_gap_and_without_a_pose() -> None:
    times = np.array([0, 1, 2, 3, 9, 10, 11, 12]) / 30
    points = line(times)
    points[6] = np.nan
    assert np.isfinite(jitter(points, times).values).tolist() == [False, True, True, False, False, False, False, False]
    assert np.isnan(jitter(points[:2], times[:2]).values).all()


# Residuals


def test_e3d_is_the_mean_distance_to_the_nearest_model_point() -> None:
    model = np.array([[0, 0, 0.5], [0.1, 0, 0.5]])
    points = np.array([[0, 0, 0.502], [0.1, 0.004, 0.5], [0.09, 0, 0.5]])
    assert e3d(points, model) == pytest.approx((2 + 4 + 10) / 3)
    assert math.isnan(e3d(np.empty((0, 3)), model))
    assert e3d(points, np.empty((0, 3))) == math.inf


def test_e2d_is_the_mean_distance_of_the_pixels_outside() -> None:
    observed = np.zeros((20, 20), dtype=np.bool_)
    observed[5:10, 5:10] = True
    rendered = np.zeros_like(observed)
    rendered[5:10, 5:12] = True  # one column at 1 px, one at 2 px
    assert e2d(rendered, observed) == pytest.approx(1.5)
    rendered[13, 13] = True  # (13, 13) is 4 and 4 px beyond (9, 9)
    assert e2d(rendered, observed) == pytest.approx((5 * 1 + 5 * 2 + math.hypot(4, 4)) / 11, rel=1e-4)
    assert e2d(observed, observed) == 0
    assert math.isnan(e2d(rendered, np.zeros_like(observed)))


def test_silhouettes_overlap() -> None:
    observed, rendered = np.zeros((2, 10, 10), dtype=np.bool_)
    observed[:4, :5] = True
    rendered[2:6, :5] = True
    assert silhouette_iou(rendered, observed) == pytest.approx(10 / 30)
    assert silhouette_iou(observed, observed) == 1
    assert silhouette_iou(observed, ~observed) == 0
    assert silhouette_iou(np.zeros((2, 2), np.bool_), np.zeros((2, 2), np.bool_)) == 1


# Time


def test_the_stages_of_a_frame_add_up() -> None:
    stages = {"segment": np.array([1.0, 2.0, 3.0]), "swarm": np.array([10.0, 10.0, 30.0])}
    assert frame_time(stages, 3).values.tolist() == [11, 12, 33]
    assert stage_times(stages, 3)["swarm"].statistics()["p95"] == pytest.approx(28)
    assert np.isnan(frame_time(stages, 4).values).tolist() == [False, False, False, True]
    assert frame_time({}, 2).statistics()["mean"] is None


def test_reliability_counts_good_frames_by_confidence() -> None:
    confidence = np.array([0.95, 0.91, 0.15, 0.12, np.nan, 0.5])
    largest = np.array([5.0, 30.0, 40.0, 10.0, 5.0, np.nan])
    found = Reliability.of(confidence, largest)
    assert found is not None
    assert (found.frames, found.good) == (4, 0.5)
    assert found.bins == ((0.1, 2, 0.5), (0.9, 2, 0.5))
    assert found.auroc == pytest.approx(3 / 4 - 1 / 4)  # pairs in order: 0.95 before both bad ones, 0.12 before none
    assert Reliability.of(np.full(3, np.nan), np.zeros(3)) is None
    perfect = Reliability.of(np.array([0.9, 0.1]), np.array([1.0, 50.0]))
    assert perfect is not None
    assert perfect.auroc == 1
    alike = Reliability.of(np.array([0.9, 0.1]), np.array([1.0, 2.0]))
    assert alike is not None
    assert alike.auroc is None

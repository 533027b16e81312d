"""Branches: a hand on a wrong branch gives way to a better one."""

from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.hand.shape import HandShape
from depthtrack.recording.branches import BRANCH_COLUMNS, Branch, branch_rows, read_branches
from depthtrack.recording.run_folder import RunWriter
from depthtrack.recording.run_rows import RunRow, read_rows
from depthtrack.recording.run_tables import rewrite_table
from depthtrack.rendering.scorer import Scores
from depthtrack.segmentation.observation import Observation
from depthtrack.synthesis.generate import Synthesiser
from depthtrack.tracking.candidate import Candidate
from depthtrack.tracking.configuration import HybridConfig, IkConfig, PsoConfig
from depthtrack.tracking.options import BranchOptions, FitRound
from depthtrack.tracking.pipeline import estimates_of
from depthtrack.tracking.registry import create_tracker
from depthtrack.tracking.stages.branches import PALM_AND_BACK, moved_along, turned
from depthtrack.tracking.stages.coarse_to_fine import run_rounds
from depthtrack.tracking.tracker import Estimate
from depthtrack.types import Array
from tests.support.hands import random_pose
from tests.support.observations import observe

FIRST, COUNT = 40, 10
RNG = np.random.default_rng(5)
WITHOUT = BranchOptions(interval=0)


@pytest.fixture(scope="module")
def made(everyday_skin: Synthesiser) -> Synthesiser:
    return everyday_skin


@pytest.fixture(scope="module")
def observations(made: Synthesiser) -> list[Observation]:
    return [observe(made, FIRST + index) for index in range(COUNT)]


def mean_error(made: Synthesiser, estimate: Estimate, index: int) -> float:
    """Return the mean distance of the joints from their truth, metres."""
    assert estimate.pose is not None
    model = HandModel(made.options.hand)
    return float(np.linalg.norm(model.keypoints(estimate.pose) - made.joints[index], axis=1).mean())


def track(made: Synthesiser, observations: list[Observation], config: PsoConfig | IkConfig | HybridConfig) -> float:
    """Return the mean error after a start with palm and back exchanged."""
    wrong = turned(made.poses[FIRST], np.zeros((0, 20)))[PALM_AND_BACK]
    with closing(create_tracker(config, made.options.hand)) as tracker:
        first = tracker.start(observations[0], wrong)
        assert mean_error(made, first, FIRST) > 0.03
        estimates = [tracker.track(each) for each in observations[1:]]
    return mean_error(made, estimates[-1], FIRST + COUNT - 1)


@pytest.mark.parametrize("config", [HybridConfig(), IkConfig(), pytest.param(PsoConfig(), marks=pytest.mark.slow)])
def test_a_palm_taken_for_a_back_is_corrected(
    made: Synthesiser, observations: list[Observation], config: PsoConfig | IkConfig | HybridConfig
) -> None:
    assert track(made, observations, config) < 0.015


def test_without_branches_a_swarm_keeps_palm_and_back_exchanged(
    made: Synthesiser, observations: list[Observation]
) -> None:
    assert track(made, observations, PsoConfig(branches=WITHOUT)) > 0.03


def test_a_tracker_goes_on_with_the_branches_of_a_run_folder(
    made: Synthesiser, observations: list[Observation], tmp_path: Path
) -> None:
    """All alternatives are followed, and none is accepted."""
    kept = BranchOptions(hopeless=100, admit=100, give_up=100, accept_late=100, accept=0, accept_at_once=0)
    hand, config = made.options.hand, HybridConfig(branches=kept)
    with closing(create_tracker(config, hand)) as whole, closing(create_tracker(config, hand)) as cut:
        estimates = [whole.start(observations[0], made.poses[FIRST]), *map(whole.track, observations[1:])]
        with RunWriter(tmp_path / "run", {}, ()) as run:
            for index, each in enumerate(estimates[:5]):
                figures = each.energy, each.agreement, each.pose, each.confidence, each.visibility, each.spread
                run.append(RunRow(index, each.timestamp, each.status, *figures, each.branches), {})
        assert estimates[4].branches
        cut.restore(estimates_of(read_rows(tmp_path / "run")))
        again = [cut.track(each) for each in observations[5:]]
    for one, other in zip(estimates[5:], again, strict=True):
        assert one.energy == other.energy
        assert np.array_equal(one.pose, other.pose)  # type: ignore[arg-type]
        assert branch_rows(0, one.branches) == branch_rows(0, other.branches)


def test_the_energy_ratio_is_a_geometric_mean() -> None:
    branch = Branch(np.zeros(27), 0.0)
    assert branch.energy_ratio == 1.0
    for energy, tracked in ((10.0, 20.0), (40.0, 20.0), (5.0, 20.0)):
        branch = branch.compared(branch.pose, energy, tracked)
    assert branch.frames == 3
    assert branch.energy_ratio == pytest.approx((0.5 * 2 * 0.25) ** (1 / 3))


def test_a_half_turn_about_the_fingers_exchanges_palm_and_back() -> None:
    pose, angles = random_pose(RNG), np.zeros((2, 20))
    poses = turned(pose, angles)
    assert poses.shape == (9, 27)
    axes, before = (
        HandModel(HandShape()).transforms(poses)[:, 0, :3, :3],
        HandModel(HandShape()).transforms(pose)[0, :3, :3],
    )
    assert np.allclose(axes[3 * PALM_AND_BACK] @ np.diag([-1, 1, -1]), before)
    assert np.allclose(poses[:, :3], pose[:3])


def test_moving_along_keeps_one_pose_relative_to_the_other() -> None:
    pose, before, after = random_pose(RNG), random_pose(RNG), random_pose(RNG)
    model = HandModel(HandShape())

    def palm(of: Array) -> Array:
        return np.asarray(model.transforms(of)[0])

    moved = moved_along(pose, before, after)
    assert np.allclose(np.linalg.inv(palm(before)) @ palm(pose), np.linalg.inv(palm(after)) @ palm(moved))
    assert np.allclose(moved_along(pose, before, before), pose)


class FitToPosition:
    """A fitter and a scorer: fits add 1 to the first number of a pose, which is its energy."""

    def __init__(self) -> None:
        self.fitted = list[float]()

    def fit_each(self, fitter: object, poses: list[Array], *others: object) -> list[Array]:
        self.fitted += [float(pose[0]) for pose in poses]
        return [pose + np.eye(27)[0] for pose in poses]

    def evaluate(self, poses: Array) -> Scores:
        return Scores(poses[:, 0], np.ones(len(poses)))


def test_a_search_fits_no_pose_again_that_does_not_go_on() -> None:
    starts = [Candidate(energy * np.eye(27)[0], energy, 1.0) for energy in (1.0, 2.0, 3.0)]
    double = FitToPosition()
    rounds = FitRound(3, None, 1, coarse=True), FitRound(2, None, 1)

    def search(goes_on: Callable[[Candidate], bool]) -> list[float]:
        found = run_rounds(double, double, double, starts, None, rounds, 1.0, goes_on=goes_on)  # type: ignore[arg-type]
        return [each.energy for each in found]

    assert search(lambda found: found.energy >= 3) == [4, 5]
    assert double.fitted == [1, 2, 3, 3, 4]
    assert search(lambda found: False) == []


def test_branches_are_read_as_written(tmp_path: Path) -> None:
    branches = [Branch(random_pose(RNG), 1 / 3, 4, -0.1), Branch(random_pose(RNG), 0.5)]
    rewrite_table(tmp_path / "branches.csv", BRANCH_COLUMNS, branch_rows(7, branches))
    found = read_branches(tmp_path / "branches.csv")
    assert list(found) == [7]
    assert branch_rows(7, found[7]) == branch_rows(7, branches)
    assert read_branches(tmp_path / "absent.csv") == {}


@pytest.mark.parametrize(("column", "value"), [("begun", "soon"), ("evidence", "nan"), ("frames", "-1"), ("x", "inf")])
def test_numbers_that_no_tracker_writes_are_refused(tmp_path: Path, column: str, value: str) -> None:
    cells = branch_rows(0, [Branch(make_pose(np.zeros(3), (1, 0, 0, 0), np.zeros(20)), 0.0)])[0]
    cells[BRANCH_COLUMNS.index(column)] = value
    rewrite_table(tmp_path / "branches.csv", BRANCH_COLUMNS, [cells])
    with pytest.raises(InputError, match=r"branches\.csv, line 2: .*branch"):
        read_branches(tmp_path / "branches.csv")

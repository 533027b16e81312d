"""Searches end at the deadline of a frame, and go on in the next frames."""

import math
from contextlib import closing
from dataclasses import dataclass, replace

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.evaluation.metrics import endpoint_error
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.recording.status import Status
from depthtrack.segmentation.observation import Observation
from depthtrack.solver.options import SurfaceFitOptions
from depthtrack.synthesis.generate import Synthesiser
from depthtrack.tracking.candidate import Candidate
from depthtrack.tracking.configuration import IkConfig
from depthtrack.tracking.frame import FrameContext, Toolkit
from depthtrack.tracking.options import (
    FitRound,
    FitSearchOptions,
    GlobalSearchOptions,
    RecoveryOptions,
    TrackingThresholds,
)
from depthtrack.tracking.registry import create_tracker
from depthtrack.tracking.stages.recover import RecoverLocally
from depthtrack.tracking.stages.search_in_parts import SearchInParts
from depthtrack.tracking.stages.searches import FitSearch, search_globally
from depthtrack.tracking.state import InterruptedSearch, TrackState
from depthtrack.tracking.timing import Deadline
from tests.support.observations import observe

MODEL = HandModel(HandShape())
SEARCH = FitSearch(FitSearchOptions((FitRound(6, 8, 3), FitRound(2, None, 6))), SurfaceFitOptions(max_points=1000))
GLOBAL = GlobalSearchOptions(proposals=1500, resolution=64, synergy_share=0.5, attempts=1)
OVER = Deadline(-math.inf)
"""A deadline that was over before the frame arrived."""


@dataclass(frozen=True)
class _Finds:
    """Stage that finds one candidate."""

    found: Candidate
    name: str = "search"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        return [self.found]


@pytest.fixture(scope="module")
def tools() -> Toolkit:
    return Toolkit(HandShape(), IkConfig().scoring)


def _frame(tools: Toolkit, observation: Observation, deadline: Deadline) -> FrameContext:
    tools.set_target(observation)
    state = TrackState(TrackingThresholds(), IkConfig().scoring.objective.clamp)
    return FrameContext(observation, tools, state, seed=0, deadline=deadline)


def test_a_deadline_counts_from_the_arrival_of_the_frame() -> None:
    clock = iter([10.02, 10.04]).__next__
    deadline = replace(Deadline.after(33.0, arrived=10.0), clock=clock)
    assert deadline.is_set
    assert [deadline.is_over for _ in range(2)] == [False, True]
    assert not Deadline.after(None, arrived=10.0).is_set
    assert Deadline.after(33.0, arrived=math.nan).is_set


def test_a_search_without_interruption_equals_the_whole_search(tools: Toolkit, everyday_skin: Synthesiser) -> None:
    observation = observe(everyday_skin, 11)
    whole = search_globally(_frame(tools, observation, Deadline()), SEARCH, GLOBAL)
    frame = _frame(tools, observation, Deadline())
    parts = SearchInParts(SEARCH, GLOBAL)(frame, [])
    np.testing.assert_array_equal(parts[0].pose, whole.pose)
    assert frame.search is None


def test_a_search_of_one_fit_a_frame_finds_what_the_whole_search_finds(
    tools: Toolkit, everyday_skin: Synthesiser
) -> None:
    """The hand stands still; frames with a moved centre move the poses too."""
    observation = observe(everyday_skin, 11)
    whole = search_globally(_frame(tools, observation, Deadline()), SEARCH, GLOBAL)
    search, energies = None, []
    for _ in range(8):
        frame = _frame(tools, observation, OVER)
        frame.state.search = search
        energies.append(SearchInParts(SEARCH, GLOBAL)(frame, [])[0].energy)
        search = frame.search
    assert search is None
    assert energies[-1] == pytest.approx(whole.energy, rel=1e-9)
    assert energies[0] > energies[-1]

    frame = _frame(tools, observation, OVER)
    SearchInParts(SEARCH, GLOBAL)(frame, [])
    began = frame.search
    assert began is not None
    moved = replace(observation, centre=observation.centre + np.array([0.01, 0.0, 0.02]))
    frame = _frame(tools, moved, OVER)
    frame.state.search = began
    SearchInParts(SEARCH, GLOBAL)(frame, [])
    assert frame.search is not None
    np.testing.assert_allclose(frame.search.waiting[0, :3] - began.waiting[1, :3], [0.01, 0.0, 0.02], atol=1e-12)


def test_a_tracker_that_is_always_late_follows_the_hand(everyday_skin: Synthesiser) -> None:
    """Each frame gets the fit of its prediction; no search runs to its end."""
    config = IkConfig(deadline=1e-6)
    with closing(create_tracker(config, HandShape())) as tracker:
        tracker.start(observe(everyday_skin, 10), everyday_skin.poses[10])
        found = [tracker.track(observe(everyday_skin, frame)) for frame in range(11, 16)]
    assert {estimate.status for estimate in found} == {Status.TRACKED}
    poses = np.stack([estimate.pose for estimate in found if estimate.pose is not None])
    errors_mm = endpoint_error(MODEL, poses, MODEL, everyday_skin.poses[11:16]).values
    assert errors_mm.max() < 0.5


@pytest.mark.parametrize("milliseconds", [-1.0, math.inf, math.nan])
def test_impossible_deadlines_are_rejected(milliseconds: float) -> None:
    with pytest.raises(InputError, match="deadline must be from 0 to"):
        IkConfig(deadline=milliseconds)


def test_a_search_that_would_be_late_begins_in_the_next_frame(tools: Toolkit, everyday_skin: Synthesiser) -> None:
    observation = observe(everyday_skin, 11)
    assert not _frame(tools, observation, Deadline()).puts_search_off()
    frame = _frame(tools, observation, Deadline(ends=10.0, length=0.03, clock=lambda: 9.99))
    assert not frame.deadline.is_over
    assert frame.puts_search_off()
    assert frame.search is not None
    assert not frame.search.has_begun
    later = _frame(tools, observation, OVER)
    later.state.search = frame.search
    SearchInParts(SEARCH, GLOBAL)(later, [])
    assert later.search is not None
    assert later.search.has_begun


def test_an_interrupted_search_goes_on_beside_a_track_that_fits_poorly(
    tools: Toolkit, everyday_skin: Synthesiser
) -> None:
    observation, found = observe(everyday_skin, 11), Candidate(everyday_skin.poses[11], 1.0, 1.0)
    recover = RecoverLocally(SEARCH, RecoveryOptions(every=0), elsewhere=[_Finds(found)])
    poor = found._replace(energy=1e3)
    frame = _frame(tools, observation, Deadline())
    frame.state.search = InterruptedSearch.put_off(observation.centre)
    assert recover(frame, [poor]) == [found]
    assert frame.restarted

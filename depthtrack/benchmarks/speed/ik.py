"""`depthtrack bench ik`: from a segmented depth map to a pose by fitting the hand's surface, on one core.

A frame is one call of the tracker: point cloud with normals of every pixel of the hand, prediction, alignment of the
whole hand, ICP iterations, and the energy that tells whether the track holds. Segmentation is not in it. An iteration
is one round of correspondences and the Gauss-Newton steps on them.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Literal, NamedTuple, get_args

import numpy as np

from depthtrack.benchmarks.speed.timing import time_calls
from depthtrack.benchmarks.speed.workload import FRAME_TIMES
from depthtrack.errors import InputError
from depthtrack.evaluation.metrics import angle_error, endpoint_error
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import ANGLES
from depthtrack.hand.synergies import Synergies
from depthtrack.machine import Machine, describe_machine
from depthtrack.solver.icp import IcpFitter
from depthtrack.solver.options import IcpOptions, Residual, SurfaceName
from depthtrack.solver.subspace import FULL, PostureSubspace
from depthtrack.synthesis.generate import Synthesis
from depthtrack.synthesis.observations import ObservedMotion
from depthtrack.text_table import aligned
from depthtrack.tracking.configuration import TrackerConfig
from depthtrack.tracking.registry import create_tracker, tracker_config
from depthtrack.tracking.stage_tracker import StageTracker
from depthtrack.tracking.surfaces.registry import make_surface
from depthtrack.tracking.tracker import Estimate
from depthtrack.types import Array

Freedom = Literal["26", "6+6"]

DISTANCE = 0.59
"""Metres: about 9,000 of a Kinect's pixels show the hand, of which the tracker's usual third makes 3,000."""
SYNERGIES = 6
"""In "6+6", of the motion's own: those of other hands fit it worse, and then the tracker tries again."""


@dataclass(frozen=True)
class Setting:
    """What is measured: every `subsample`-th point, matched to `model` by `residual`, `freedom` degrees of freedom,
    `icp` rounds of correspondences with at most `inner` Gauss-Newton steps each."""

    model: SurfaceName = "skin"
    residual: Residual = "symmetric"
    freedom: Freedom = "26"
    subsample: int = 3
    icp: int = 5
    inner: int = 5

    @property
    def config(self) -> TrackerConfig:
        """Configuration of a tracker with this setting."""
        return tracker_config(
            "ik",
            surface=self.model,
            residual=self.residual,
            icp_iterations=self.icp,
            gn_iterations=self.inner,
            subsample=self.subsample,
            **({} if self.freedom == "26" else {"synergies": "leap"}),
        )

    def synergies(self, motion: ObservedMotion) -> Synergies | None:
        """Return the synergies of the motion's own motion, None with all degrees of freedom."""
        return None if self.freedom == "26" else Synergies.fit(motion.poses[:, ANGLES]).truncated(SYNERGIES)


HEADLINE = Setting()
SETTINGS: tuple[Setting, ...] = tuple(
    dict.fromkeys(
        [
            HEADLINE,
            *(Setting(*each) for each in product(get_args(SurfaceName), get_args(Residual), get_args(Freedom))),
            *(Setting(model, subsample=n) for model in get_args(SurfaceName) for n in (9, 1)),
            *(Setting(icp=icp, inner=inner) for icp, inner in ((5, 1), (10, 5))),
        ]
    )
)


@dataclass(frozen=True)
class IkRow:
    """One setting, over all frames.

    `points` matched, on average. Best and median of many calls: `iteration_us` microseconds an ICP iteration,
    `frame_ms` milliseconds a frame, of which median `stage_ms`; `frames_per_s` from the best, `frames_per_s_median`
    from the median; `calls` timed. `error_deg` and `error_mm` of the frames' poses.
    """

    points: int
    model: SurfaceName
    residual: Residual
    freedom: Freedom
    threads: int
    icp: int
    inner: int
    iteration_us: float
    iteration_us_median: float
    frame_ms: float
    frame_ms_median: float
    stage_ms: dict[str, float]
    frames_per_s: float
    frames_per_s_median: float
    calls: int
    error_deg: float
    error_mm: float


@dataclass(frozen=True)
class IkReport:
    """All that `bench ik` measured; `machine` as it was before."""

    benchmark: Literal["ik"]
    machine: Machine
    rows: list[IkRow]


@dataclass(frozen=True)
class IkPlan:
    """What to measure: `seconds` for each of `settings`."""

    seconds: float
    settings: tuple[Setting, ...] = SETTINGS

    @property
    def row_count(self) -> int:
        return len(self.settings)


def plan(seconds: float = 1.0) -> IkPlan:
    """A plan for all settings. Raises InputError for an unusable time."""
    if not 0 < seconds <= 600:
        raise InputError(f"--seconds must lie between 0 and 600 a row, found {seconds:g}")
    return IkPlan(seconds)


def run(plan: IkPlan, progress: Callable[[Iterator[IkRow]], Iterable[IkRow]] = iter) -> IkReport:
    """Measure; `progress` may watch the rows go by."""
    machine, motion = describe_machine(), ObservedMotion(Synthesis(model="skin", distance=DISTANCE))
    rows = (measure(motion, setting, plan.seconds) for setting in plan.settings)
    return IkReport("ik", machine, list(progress(rows)))


def measure(motion: ObservedMotion, setting: Setting, seconds: float) -> IkRow:
    """The row of a setting, on four frames of the motion, each reached from the two before it."""
    frames = [round(at * motion.recording.rate) for at in FRAME_TIMES]
    share = seconds / len(frames) / 2
    with closing(create_tracker(setting.config, motion.hand, synergies=setting.synergies(motion))) as tracker:
        timed = [_time_frame(tracker, motion, index, share) for index in frames]
    poses, frame_s = np.array([each.pose for each in timed]), [each.seconds for each in timed]
    iteration_s = [
        _time_fit(motion, setting, index, each.before, share) for index, each in zip(frames, timed, strict=True)
    ]
    hand, truth = HandModel(motion.hand), motion.poses[frames]
    frame, frame_median = _best_and_median(frame_s)
    iteration, iteration_median = (each / setting.icp for each in _best_and_median(iteration_s))
    return IkRow(
        points=round(np.mean([len(motion[index].points) for index in frames]) / setting.subsample),
        model=setting.model,
        residual=setting.residual,
        freedom=setting.freedom,
        threads=1,
        icp=setting.icp,
        inner=setting.inner,
        iteration_us=1e6 * iteration,
        iteration_us_median=1e6 * iteration_median,
        frame_ms=1e3 * frame,
        frame_ms_median=1e3 * frame_median,
        stage_ms={stage: float(np.mean([each.stage_ms[stage] for each in timed])) for stage in tracker.stages},
        frames_per_s=1 / frame,
        frames_per_s_median=1 / frame_median,
        calls=sum(map(len, frame_s)),
        error_deg=float(angle_error(poses, truth).values.mean()),
        error_mm=float(endpoint_error(hand, poses, hand, truth).values.mean()),
    )


class _Timed(NamedTuple):
    """A frame's `pose` (27,) and that of the frame `before` it; `seconds` of each call, median `stage_ms`."""

    pose: Array
    before: Array
    seconds: Array
    stage_ms: dict[str, float]


def _time_frame(tracker: StageTracker, motion: ObservedMotion, index: int, seconds: float) -> _Timed:
    """How long the tracker takes from the frame before to this one."""
    before = [
        tracker.start(motion[index - 2], motion.poses[index - 2]),
        tracker.track(motion[index - 1]),
    ]
    made = list[Estimate]()

    def track() -> None:
        tracker.restore(before)
        made.append(tracker.track(motion.uncached(index)))

    track()
    durations = time_calls(track, seconds)
    pose, last = made[-1].pose, before[-1].pose
    assert pose is not None
    assert last is not None
    stages = {stage: float(np.median([each.stage_ms[stage] for each in made])) for stage in tracker.stages}
    return _Timed(pose, last, durations, stages)


def _time_fit(motion: ObservedMotion, setting: Setting, index: int, pose: Array, seconds: float) -> Array:
    """How long each fit to a frame took, from `pose` (27,), without the alignment of the whole hand before it."""
    synergies = setting.synergies(motion)
    space = FULL if synergies is None else PostureSubspace.of(synergies)
    options = replace(
        IcpOptions(),
        residual=setting.residual,
        icp_iterations=setting.icp,
        gn_iterations=setting.inner,
        rigid_iterations=0,
    )
    fitter = IcpFitter(motion.hand, make_surface(setting.model, motion.hand), options)
    fitter.set_target(motion[index], setting.subsample)
    fitter.fit(pose, space)
    return time_calls(partial(fitter.fit, pose, space), seconds)


def _best_and_median(durations: list[Array]) -> tuple[float, float]:
    """Seconds, averaged over the frames."""
    return float(np.mean([each.min() for each in durations])), float(np.mean([np.median(each) for each in durations]))


def as_text(report: IkReport) -> str:
    """The report as lines for people: the machine, a row a setting, and what is timed."""
    head = ("model", "residual", "DoF", "points", "ICP", "us/iteration", "ms/frame", "(median)", "frames/s", "error")
    lines = [
        (
            row.model,
            row.residual,
            row.freedom,
            f"{row.points:,}",
            f"{row.icp} x {row.inner}",
            f"{row.iteration_us:,.0f}",
            f"{row.frame_ms:.2f}",
            f"({row.frame_ms_median:.2f})",
            f"{row.frames_per_s:,.0f}",
            f"{row.error_deg:.2f} deg",
        )
        for row in report.rows
    ]
    return "\n".join(
        [
            report.machine.headline,
            "one thread, best calls (median), a hand seen in 9,000 pixels:",
            "",
            *aligned([head, *lines], left=2),
            "",
            "frame: scoring target, prediction, point cloud with normals, alignment, fit, energy and confidence",
            *(f"first row, median: {_stages(row)}" for row in report.rows[:1]),
            "iteration: correspondences, and the Gauss-Newton steps on them; ICP: iterations x steps, at most",
            "Schroeder et al. 2014, on eight threads: 25 frames a second with 26 DoF, 30 with 6+6",
        ]
    )


def _stages(row: IkRow) -> str:
    rest = row.frame_ms_median - sum(row.stage_ms.values())
    return ", ".join(f"{name} {ms:.2f}" for name, ms in [*row.stage_ms.items(), ("energy", rest)]) + " ms"

"""`depthtrack bench ik`: measure the surface fit, from depth map to pose, on one core.

A frame is one call of the tracker: point cloud with normals of all hand pixels, prediction, rigid alignment, ICP
iterations, and the energy that decides whether the track is lost. Segmentation is left out. An iteration finds
correspondences once and takes Gauss-Newton steps on them.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Literal, NamedTuple, get_args

import numpy as np

from depthtrack.benchmarks.speed.timing import checked_seconds, time_calls
from depthtrack.benchmarks.speed.workload import FRAME_TIMES
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
"""Camera-to-hand distance, m, at which 9,000 pixels of a Kinect show the hand; the tracker uses 3,000 of them."""
SYNERGIES = 6
"""Number of synergies in "6+6". They are fitted to the motion, since a worse fit would trigger searches."""


@dataclass(frozen=True)
class Setting:
    """Settings of one row.

    model: surface.
    residual: residual of the correspondences.
    freedom: degrees of freedom.
    subsample: one of this number of points is used.
    icp: ICP iterations.
    inner: largest number of Gauss-Newton steps per iteration.
    """

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
        """Return synergies fitted to the motion; None with all degrees of freedom."""
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
    """Measurements of one setting over all frames.

    points: mean number of points.
    iteration_us, iteration_us_median: microseconds per ICP iteration, best and median call.
    frame_ms, frame_ms_median: milliseconds per frame, best and median call.
    stage_ms: median milliseconds per frame of each stage.
    frames_per_s, frames_per_s_median: frames per second from the best and the median call.
    calls: number of timed calls.
    error_deg, error_mm: mean errors of joint angles and endpoints.
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
    """Report of `bench ik`.

    machine: the machine before the measurements.
    """

    benchmark: Literal["ik"]
    machine: Machine
    rows: list[IkRow]


@dataclass(frozen=True)
class IkPlan:
    """Plan of a measurement: `seconds` for each setting."""

    seconds: float
    settings: tuple[Setting, ...] = SETTINGS

    @property
    def row_count(self) -> int:
        """Number of rows."""
        return len(self.settings)


def plan(seconds: float = 1.0) -> IkPlan:
    """Return a plan for all settings.

    Raises:
        InputError: if the time is out of range.
    """
    return IkPlan(checked_seconds(seconds))


def run(plan: IkPlan, progress: Callable[[Iterator[IkRow]], Iterable[IkRow]] = iter) -> IkReport:
    """Return the measurements of a plan.

    progress: wraps the rows, as a progress bar does.
    """
    machine, motion = describe_machine(), ObservedMotion(Synthesis(model="skin", distance=DISTANCE))
    rows = (measure(motion, setting, plan.seconds) for setting in plan.settings)
    return IkReport("ik", machine, list(progress(rows)))


def measure(motion: ObservedMotion, setting: Setting, seconds: float) -> IkRow:
    """Return the row of a setting: four frames of the motion, each tracked after two others."""
    # At whole seconds a tracker searches for other hands: these frames are usual ones.
    frames = [round(at * motion.recording.rate) + 2 for at in FRAME_TIMES]
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
    """Timed calls of one frame.

    pose: (27,).
    before: (27,) pose of the frame before.
    seconds: time of each call.
    stage_ms: median milliseconds of each stage.
    """

    pose: Array
    before: Array
    seconds: Array
    stage_ms: dict[str, float]


def _time_frame(tracker: StageTracker, motion: ObservedMotion, index: int, seconds: float) -> _Timed:
    """Return the time of the tracker for one frame."""
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
    """Return the time (N,) of each fit from `pose` (27,), without rigid alignment, s."""
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
    """Return the best and the median time, averaged over the frames, s."""
    return float(np.mean([each.min() for each in durations])), float(np.mean([np.median(each) for each in durations]))


def as_text(report: IkReport) -> str:
    """Return the report as text: the machine, one row per setting, and notes."""
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
            "one thread, best calls (median), hand of 9,000 pixels:",
            "",
            *aligned([head, *lines], left=2),
            "",
            "frame: scoring target, prediction, point cloud with normals, alignment, fit, energy and confidence",
            *(f"first row, median: {_stages(row)}" for row in report.rows[:1]),
            "iteration: correspondences and Gauss-Newton steps; ICP: largest number of iterations x steps",
            "Schroeder et al. 2014, on eight threads: 25 frames per second with 26 DoF, 30 with 6+6",
        ]
    )


def _stages(row: IkRow) -> str:
    rest = row.frame_ms_median - sum(row.stage_ms.values())
    return ", ".join(f"{name} {ms:.2f}" for name, ms in [*row.stage_ms.items(), ("energy", rest)]) + " ms"

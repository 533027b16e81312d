"""Pipeline of a hand whose side and sizes are unknown, and measured while it is tracked.

Hands of both sides are tracked, each with its own sizes, until the energy of one is clearly lower. The right one leads
at first, since a flat hand looks alike from either side.

Sizes of the whole hand are compared first, in a few views of the leading hand. Then all sizes are measured again and
again. Both are done in another thread. A result is used at a fixed visible time after its begin, when the next
measurement begins. If it is not there by then, the frame waits for it, so that equal frames give equal bits. Frames
with a deadline do not wait: a late result is used in the first frame after it.
"""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace

from depthtrack.calibration.calibrate import Measured
from depthtrack.calibration.ongoing import KeptViews, MakeTracker, OngoingSizes, first_scale, measure
from depthtrack.calibration.options import OngoingOptions
from depthtrack.closing import Closing
from depthtrack.errors import InputError
from depthtrack.hand.shape import HandShape, Side, other_side
from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.solver.options import SurfaceName
from depthtrack.tracking.pipeline import Pipeline, TrackedFrame
from depthtrack.tracking.surfaces.registry import make_surface
from depthtrack.tracking.tracker import Estimate
from depthtrack.types import Array

MakeSegmenter = Callable[[Frame], Segmenter]
"""Returns a segmenter for frames like this one, with or without colour."""
_SURFACES: tuple[SurfaceName, ...] = ("skin", "primitives")
"""Surfaces that trackers fit, and share."""
_LEAST_ENERGY = 1e-3
"""Energy that a ratio of energies is limited to."""


def prepared(sizes: OngoingSizes) -> OngoingSizes:
    """Make the surfaces of a hand, which are kept: the next tracker need not sample them."""
    for surface in _SURFACES:
        make_surface(surface, sizes.hand)
    return sizes


class OngoingHand(Closing):
    """Hand of one side: its tracker, its sizes so far, and the views that they are measured in."""

    def __init__(
        self,
        side: Side,
        make: MakeTracker,
        make_segmenter: MakeSegmenter,
        start_pose: Array | None,
        options: OngoingOptions,
    ) -> None:
        self.sizes, self._make, self._options = OngoingSizes.scaled(side), make, options
        self._tracker, self._start_pose = make(self.sizes.hand), start_pose
        self._make_segmenter = make_segmenter
        self._segmenter: Segmenter | None = None
        self._pipeline: Pipeline | None = None
        self._last: deque[Estimate] = deque(maxlen=2)
        self._kept = KeptViews(options)

    def step(self, frame: Frame, visible: float) -> TrackedFrame:
        """Segment and track one frame.

        visible: time in which the hand was visible so far, s.
        """
        if self._pipeline is None:
            self._segmenter = self._segmenter or self._make_segmenter(frame)
            self._pipeline = Pipeline(self._tracker, self._segmenter, self.sizes.hand, self._start_pose)
        tracked = self._pipeline.step(frame)
        self._last.append(tracked.estimate)
        self._kept.add(tracked, visible)
        return replace(tracked, estimate=replace(tracked.estimate, hand=self.sizes.hand))

    def measurement(self) -> Callable[[], OngoingSizes]:
        """Return a function that measures the sizes in the views so far; those so far if that fails."""
        views, sizes, options = self._kept.views, self.sizes, self._options

        def measured() -> OngoingSizes:
            try:
                return prepared(measure(views, sizes, options))
            except InputError:
                return sizes

        return measured

    def comparison(self) -> Callable[[], float]:
        """Return a function that measures the scale in the views so far; 1 if that fails."""
        views, hand, options, make = self._kept.views, self.sizes.hand, self._options, self._make

        def compared() -> float:
            try:
                return first_scale(views, hand.side, make, options)
            except InputError:
                return hand.scale

        return compared

    def use(self, sizes: OngoingSizes) -> bool:
        """Go on with these sizes. Return whether they differ from those so far.

        The new tracker restores the last two estimates: the pose, and the motion to it.
        """
        if not sizes.differs(self.sizes, self._options.least_change):
            self.sizes = replace(self.sizes, measured=sizes.measured)
            return False
        tracker = self._make(sizes.hand)
        tracker.restore(self._last)
        self._tracker.close()
        self._tracker, self.sizes, self._pipeline, self._start_pose = tracker, sizes, None, None
        return True

    def close(self) -> None:
        """Free the tracker."""
        self._tracker.close()


class OngoingPipeline(Closing):
    """Pipeline that measures the hand. Each estimate names the hand that it was made with.

    make: returns the tracker of a hand.
    make_segmenter: returns the segmenter for frames like the first one.
    start_pose: (27,) see `Pipeline`.
    waits: whether frames wait for results.
    side: of the hand in use.
    """

    def __init__(
        self,
        make: MakeTracker,
        make_segmenter: MakeSegmenter,
        start_pose: Array | None = None,
        options: OngoingOptions | None = None,
        waits: bool = True,
    ) -> None:
        self._options, self._waits = options or OngoingOptions(), waits
        sides: tuple[Side, ...] = ("right", "left")
        self._hands = {side: OngoingHand(side, make, make_segmenter, start_pose, self._options) for side in sides}
        self._energies: dict[Side, float] = dict.fromkeys(sides, 0.0)
        self.side: Side = "right"
        self._visible, self._time = 0.0, float("nan")
        self._compares = len(self._options.first_scales) > 1
        self._due = self._options.scale_begin if self._compares else self._options.begin
        self._period, self._measures = self._options.period, False
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="measurement")
        self._pending: Future[dict[Side, OngoingSizes]] | None = None

    @property
    def side_sure(self) -> bool:
        """Whether the other side was given up."""
        return len(self._hands) == 1

    @property
    def hand(self) -> HandShape:
        """Hand in use."""
        return self._hands[self.side].sizes.hand

    @property
    def measured(self) -> dict[str, Measured]:
        """Each length and width of the hand by name; empty before the first measurement."""
        return dict(self._hands[self.side].sizes.measured)

    def step(self, frame: Frame) -> TrackedFrame:
        """Segment and track one frame."""
        tracked = {side: hand.step(frame, self._visible) for side, hand in self._hands.items()}
        self._compare(tracked)
        found = tracked[self.side]
        if found.estimate.status.is_trusted:
            elapsed = frame.timestamp - self._time
            self._visible += min(elapsed, self._options.longest_step) if elapsed > 0 else 0.0
        self._time = frame.timestamp
        if self._visible >= self._due and (self._waits or self._pending is None or self._pending.done()):
            if not self._waits:
                self._due = self._visible
            self._give_up_side()
            stays = self._use_measurement()
            if self._compares:
                self._begin_comparison()
                self._compares, self._due = False, self._options.begin
            else:
                self._begin_measurement()
                self._period *= 2 if stays and self._measures else 1
                self._measures, self._due = True, self._due + self._period
        return found

    def _compare(self, tracked: dict[Side, TrackedFrame]) -> None:
        """Add the energies of a frame with both poses.

        The side of the clearly lower energy leads from here on.
        """
        estimates = {side: each.estimate for side, each in tracked.items()}
        if self.side_sure or any(each.pose is None for each in estimates.values()):
            return
        self._energies = {side: self._energies[side] + each.comparable_energy for side, each in estimates.items()}
        if self._excess(self.side) >= self._options.lead_margin:
            self.side = other_side(self.side)

    def _excess(self, side: Side) -> float:
        """Return the share by which the energy of a side is higher than that of the other one."""
        return self._energies[side] / max(self._energies[other_side(side)], _LEAST_ENERGY) - 1

    def _use_measurement(self) -> bool:
        """Wait for the sizes that are being measured, and go on with them.

        Returns whether they are those so far.
        """
        if self._pending is None:
            return False
        found = self._pending.result()
        changed = [hand.use(found[side]) for side, hand in self._hands.items()]
        self._energies = {side: self._options.kept_evidence * each for side, each in self._energies.items()}
        return not any(changed)

    def _begin_comparison(self) -> None:
        """Compare sizes of the whole hand in the views of the leading side, in the other thread."""
        job, sides = self._hands[self.side].comparison(), tuple(self._hands)

        def compared() -> dict[Side, OngoingSizes]:
            scale = job()
            return {side: prepared(OngoingSizes.scaled(side, scale)) for side in sides}

        self._pending = self._pool.submit(compared)

    def _begin_measurement(self) -> None:
        """Measure the sizes of each side in the views so far, in the other thread."""
        jobs = {side: hand.measurement() for side, hand in self._hands.items()}
        self._pending = self._pool.submit(lambda: {side: job() for side, job in jobs.items()})

    def _give_up_side(self) -> None:
        """Give up the side of the higher energy if that is clearly higher."""
        other = other_side(self.side)
        late = self._visible >= self._options.sure_after
        if not self.side_sure and late and self._excess(other) >= self._options.sure_margin:
            self._hands.pop(other).close()

    def close(self) -> None:
        """Free the trackers."""
        self._pool.shutdown(cancel_futures=True)
        for hand in self._hands.values():
            hand.close()

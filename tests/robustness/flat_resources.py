"""Memory, file descriptors and threads stay where they are, however long depthtrack runs.

    python -m tests.robustness.flat_resources --frames 20000 --opened 2000    # hours
    python -m tests.robustness.flat_resources --tracker ik --seconds 3600     # an hour of frames
    python -m tests.robustness.flat_resources --backend osmesa                # OpenGL has one platform a process

Exit code 1 if memory grows after the first quarter by more than MOST_GROWTH, or a descriptor or thread is left.
"""

import argparse
import gc
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path

import numpy as np

from depthtrack.errors import DepthtrackError
from depthtrack.hand.shape import HandShape
from depthtrack.recording.sequence import Frame
from depthtrack.rendering.backends import BACKENDS, create_scorer
from depthtrack.rendering.target import Target
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.tracking.configuration import CONFIGURATIONS
from depthtrack.tracking.pipeline import Pipeline, track_frames
from depthtrack.tracking.registry import create_tracker

MOST_GROWTH = 24.0
"""MB: allocators keep some pages, and the last frames are kept for the report of a lost hand."""
_RATE = 30.0


@dataclass(frozen=True)
class Use:
    """Resources of this process: resident memory in MB, open descriptors, threads."""

    megabytes: float
    descriptors: int
    threads: int

    @classmethod
    def now(cls) -> "Use":
        """Return the use of this process, after garbage is collected."""
        gc.collect()
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
        return cls(pages * os.sysconf("SC_PAGE_SIZE") / 1e6, len(os.listdir("/proc/self/fd")), threading.active_count())


@dataclass(frozen=True)
class Growth:
    """What was repeated, and the use of resources after a quarter and at the end."""

    what: str
    repetitions: int
    quarter: Use
    end: Use

    @property
    def is_flat(self) -> bool:
        """Whether nothing grows."""
        return (
            self.end.megabytes - self.quarter.megabytes <= MOST_GROWTH
            and self.end.descriptors <= self.quarter.descriptors
            and self.end.threads <= self.quarter.threads
        )

    def row(self) -> str:
        """Return a line of the table."""
        quarter, end = self.quarter, self.end
        return (
            f"{self.what:28}{self.repetitions:>9}{end.megabytes:>10.0f} MB{end.megabytes - quarter.megabytes:>+9.1f} MB"
            f"{end.descriptors - quarter.descriptors:>+13}{end.threads - quarter.threads:>+9}"
            f"  {'flat' if self.is_flat else 'GROWS'}"
        )


def repeat(what: str, steps: Iterator[object], number: int, seconds: float = 0.0) -> Growth:
    """Take steps, at least `number` and for at least `seconds`, and measure what they leave."""
    quarter, begun, done = None, time.monotonic(), 0
    while done < number or time.monotonic() - begun < seconds:
        next(steps)
        done += 1
        if quarter is None and 4 * done >= number and 4 * (time.monotonic() - begun) >= seconds:
            quarter = Use.now()
    assert quarter is not None
    return Growth(what, done, quarter, Use.now())


def frames_without_end(made: Synthesiser) -> Iterator[Frame]:
    """Yield the frames of a recording forward and backward, without end."""
    frames = [made[index] for index in range(len(made))]
    there_and_back = frames + frames[-2:0:-1]
    for number in count():
        frame = there_and_back[number % len(there_and_back)]
        yield Frame(number, number / _RATE, np.asarray(frame.depth, np.float32), frame.colour, made.sensor.camera)


def tracked(name: str, made: Synthesiser) -> Iterator[object]:
    """Track frames without end."""
    config, hand = CONFIGURATIONS[name](), HandShape()
    tracker = create_tracker(config, hand)
    try:
        yield from track_frames(frames_without_end(made), Pipeline(tracker, Segmenter(), hand))
    finally:
        tracker.close()


def opened_trackers(name: str) -> Iterator[object]:
    """Open and close trackers without end."""
    config, hand = CONFIGURATIONS[name](), HandShape()
    while True:
        create_tracker(replace(config, seed=1), hand).close()
        yield None


def opened_scorers(backend: str, target: Target, made: Synthesiser) -> Iterator[object]:
    """Open and close scorers that score a pose, without end."""
    pose = made.poses[:1]
    while True:
        with create_scorer(backend, HandShape()) as scorer:
            scorer.set_target(target)
            scorer.score(pose)
        yield None


def measure(
    frames: int, opened: int, trackers: list[str], backends: list[str], seconds: float = 0.0
) -> Iterator[Growth]:
    """Yield the growth of each repeated step.

    frames: number to track by each of the trackers.
    opened: number of trackers and of scorers of each of the backends to open.
    seconds: least time of tracking.
    """
    made = Synthesiser(Synthesis(model="skin", frames=8))
    for name in trackers:
        yield repeat(f"frames of {name}", tracked(name, made), frames, seconds)
    if opened:
        yield from _opened(opened, trackers, backends, made)


def _opened(number: int, trackers: list[str], backends: list[str], made: Synthesiser) -> Iterator[Growth]:
    for name in trackers:
        yield repeat(f"trackers {name}", opened_trackers(name), number)
    target = _small_target(made)
    for backend in backends:
        steps = opened_scorers(backend, target, made)
        try:
            next(steps)
        except DepthtrackError as error:
            print(f"scorers {backend}: skipped: {error}", file=sys.stderr)
            continue
        yield repeat(f"scorers {backend}", steps, number)


def _small_target(made: Synthesiser) -> Target:
    from tests.support.observations import observe

    return observe(made, 0).reduced(24)


def main(show: Callable[[str], None] = print) -> int:
    parser = argparse.ArgumentParser(description="Track and open for long, and measure what grows.")
    parser.add_argument("--frames", type=int, default=20_000, help="frames of each tracker")
    parser.add_argument("--opened", type=int, default=2_000, help="trackers, and scorers of each backend")
    parser.add_argument("--tracker", nargs="+", default=["ik", "hybrid"], choices=list(CONFIGURATIONS))
    parser.add_argument("--seconds", type=float, default=0.0, help="least time of each tracker")
    parser.add_argument("--backend", nargs="+", default=["raster", "egl", "oracle"], choices=list(BACKENDS))
    given = parser.parse_args()
    show(f"{'what':28}{'times':>9}{'memory':>13}{'growth':>12}{'descriptors':>13}{'threads':>9}")
    flat = True
    for growth in measure(given.frames, given.opened, given.tracker, given.backend, given.seconds):
        show(growth.row())
        flat = flat and growth.is_flat
    return 0 if flat else 1


if __name__ == "__main__":
    sys.exit(main())

"""Choose the gain at which colour counts as not registered to the depth.

Usage: tune_colour_shift.py FOLDER [--seeds 10 11 12 13] [--real PATH...] [--report-seeds 1010 1011 1012 1013]
                            [--report PATH...]

Synthetic recordings of each seed show several scenes with several sensors. They and the real ones are read as they are.
Then their colour is shifted by 5 to 25 pixels in eight directions. The gain (`LEAST_GAIN` of
recording.colour_registration) is the largest one with which 99 of 100 shifts of the tuning recordings are reported. It
must exceed those of registered colour that seems shifted. Printed are both, and the mistakes with the present gain.
"""

import argparse
import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

# The checkout that this script lies in, whatever is installed.
sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np

from depthtrack.recording import Sequence, open_sequence
from depthtrack.recording.colour_registration import (
    LEAST_GAIN,
    LEAST_SHIFT,
    best_shift,
    coloured_frames,
    edge_correlation,
)
from depthtrack.synthesis.generate import BackgroundKind, SensorName, Synthesis, Synthesiser, write_recording
from depthtrack.synthesis.held_object import HeldKind

SCENES: tuple[tuple[str, SensorName, BackgroundKind, HeldKind], ...] = (
    ("everyday", "kinect1", "room", "none"),
    ("everyday", "ideal", "none", "none"),
    ("signs", "kinect1", "wall", "none"),
    ("fast", "kinect2", "room", "none"),
    ("grasp", "kinect1", "room", "sphere"),
)
DISTANCES = (5, 7, 10, 15, 25)
_REPORTED = 0.99
"""Share of the shifts that the gain must report."""


@dataclass(frozen=True)
class Measured:
    """Shift found in a recording whose colour was shifted by `given`, (right, down) in pixels."""

    name: str
    given: tuple[int, int]
    found: tuple[float, float]
    gain: float

    @property
    def is_found(self) -> bool:
        """Whether the shift is that of the colour, within 2 pixels or a tenth."""
        tolerance = max(2.0, 0.1 * math.hypot(*self.given))
        return math.dist(self.given, self.found) <= tolerance

    @property
    def is_far(self) -> bool:
        """Whether the shift is one that may be reported."""
        return math.hypot(*self.found) >= LEAST_SHIFT

    @property
    def is_reported(self) -> bool:
        """Whether the colour counts as not registered, by the present gain."""
        return self.is_far and self.gain >= LEAST_GAIN


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--seeds", type=int, nargs="+", default=[10, 11, 12, 13])
    arguments.add_argument("--report-seeds", type=int, nargs="+", default=[1010, 1011, 1012, 1013])
    arguments.add_argument("--real", type=Path, nargs="*", default=[])
    arguments.add_argument("--report", type=Path, nargs="*", default=[])
    chosen = arguments.parse_args()
    tuning = list(measured(chosen.folder, chosen.seeds, chosen.real))
    registered = max((each.gain for each in tuning if each.given == (0, 0) and each.is_far), default=1.0)
    shifted = [each.gain if each.is_far else 1.0 for each in tuning if each.given != (0, 0)]
    gain = float(np.quantile(shifted, 1 - _REPORTED))
    print(f"gain of 99 % of the shifts: {gain:.3f}; largest of registered colour that seems shifted: {registered:.3f}")
    print(f"present gain: {LEAST_GAIN}")
    summary("tuning", tuning)
    summary("report", list(measured(chosen.folder, chosen.report_seeds, chosen.report)))


def measured(folder: Path, seeds: list[int], real: list[Path]) -> Iterator[Measured]:
    for path in [*(made(folder, seed, number) for seed in seeds for number in range(len(SCENES))), *real]:
        yield from of_recording(open_sequence(path))


def made(folder: Path, seed: int, number: int) -> Path:
    """Return a synthetic recording, which is made if it is missing."""
    motion, sensor, background, held = SCENES[number]
    path = folder / f"{motion}-{sensor}-{background}-{seed}"
    if not path.exists():
        options = Synthesis(
            motion,
            model="skin",
            sensor=sensor,
            background=background,
            held_object=held,
            viewpoint=seed % 5,
            seed=seed,
            frames=9,
        )
        write_recording(Synthesiser(options), path)
    return path


def of_recording(recording: Sequence) -> Iterator[Measured]:
    """Yield the shift found for each shift of the colour, which wraps at the border."""
    correlation = edge_correlation(list(coloured_frames(recording)))
    if correlation is None:
        return
    directions = [(round(math.cos(k * math.pi / 4), 6), round(math.sin(k * math.pi / 4), 6)) for k in range(8)]
    shifts = {(round(d * x), round(d * y)) for d in DISTANCES for x, y in directions}
    for right, down in [(0, 0), *sorted(each for each in shifts if math.hypot(*each) > 4.9)]:
        found = best_shift(np.roll(correlation, (down, right), axis=(0, 1)))
        yield Measured(recording.name, (right, down), found.pixels, found.gain)


def summary(name: str, results: list[Measured]) -> None:
    """Print how often the present gain is right."""
    registered = [each for each in results if each.given == (0, 0)]
    shifted = [each for each in results if each.given != (0, 0)]
    wrong = [each for each in registered if each.is_reported]
    missed = [each for each in shifted if not each.is_reported]
    print(f"{name}: {len(registered) - len(wrong)} of {len(registered)} registered recordings are accepted,")
    found = sum(each.is_found for each in shifted)
    print(f"  {len(shifted) - len(missed)} of {len(shifted)} shifts are reported, {found} with their place")
    for each in [*wrong, *missed][:20]:
        right, down = each.found
        print(f"  wrong: {each.name}, shifted by {each.given}, found ({right:+.0f}, {down:+.0f}), gain {each.gain:.3f}")


if __name__ == "__main__":
    main()

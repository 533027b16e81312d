"""`depthtrack markers compare-layouts`: solve a hand from a few of its markers."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from depthtrack.cli.stated_default import number, stated_default
from depthtrack.errors import InputError
from depthtrack.ranges import MOST_SEED

if TYPE_CHECKING:
    from depthtrack.markers.layout.capture_comparison import CaptureComparison


@dataclass(frozen=True)
class Command:
    """Solve a recorded hand from a few of its markers, and measure the error at the others.

    The choices of least expected error and of the paper's objective, farthest points and random choices are compared.
    One half of the capture gives the synergies and chooses, the other half gives the errors.
    """

    path: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="FOLDER")]
    """Folder that `markers solve` wrote."""
    model: Annotated[str | None, stated_default(metavar="NAME")] = None
    """Hand in the folder (default: the first one)."""
    markers: Annotated[tuple[int, ...], number(3, 64, aliases=("-k",), metavar="K ...")] = (4, 6, 8, 10)
    """Numbers of markers."""
    half: Literal["first", "second"] = "first"
    """Half of the capture that chooses."""
    random: Annotated[int, number(1, 10_000)] = 100
    """Random choices of each number."""
    seed: Annotated[int, number(0, MOST_SEED)] = 1000
    """Seed of the random choices."""
    json: bool = False
    """Print figures as JSON instead of a table."""

    def run(self) -> None:
        from depthtrack.cli.progress import percent_bar
        from depthtrack.markers.folder.reading import MarkerFolder
        from depthtrack.markers.layout.capture_comparison import HeldOutHalf, compare_choices
        from depthtrack.strict_data import json_text

        if not self.markers:
            raise InputError("a comparison needs numbers of markers, as --markers 4 6 8")
        labelled = MarkerFolder.load(self.path).labelled
        hands = {model.name: k for k, model in enumerate(labelled.models) if not model.is_rigid}
        name = next(iter(hands), None) if self.model is None else self.model
        if name not in hands:
            raise InputError(f"{self.path} has no hand '{name}': choose among {', '.join(hands) or 'none'}")
        halves = HeldOutHalf.of(labelled, hands[name], self.half)
        with percent_bar() as show:
            found = [
                compare_choices(
                    halves,
                    count,
                    self.random,
                    self.seed,
                    lambda share, count=count: show(f"{count} markers", share),  # type: ignore[misc]
                )
                for count in self.markers
            ]
        rows = [_row(each) for each in found]
        print(json_text(rows, indent=2) if self.json else _text(name, rows))


def _row(found: "CaptureComparison") -> dict[str, Any]:
    import numpy as np

    return {
        "markers": found.markers,
        "ours_mm": round(1000 * found.ours.error, 3),
        "paper_mm": round(1000 * found.paper.error, 3),
        "farthest_mm": round(1000 * found.farthest.error, 3),
        "random_mean_mm": round(1000 * float(found.random.mean()), 3),
        "random_median_mm": round(1000 * float(np.median(found.random)), 3),
        "random_best_mm": round(1000 * float(found.random.min()), 3),
        "random_worse": round(float(np.mean(found.random > found.ours.error)), 4),
        "ours": list(found.ours.labels),
        "paper": list(found.paper.labels),
    }


def _text(name: str, rows: list[dict[str, Any]]) -> str:
    from depthtrack.text_table import aligned

    head = ("markers", "ours", "paper's", "farthest", "random, mean", "median", "best", "worse than ours", "our choice")
    lines: list[tuple[str, ...]] = [head]
    for row in rows:
        errors = [f"{row[key]:.2f} mm" for key in ("ours_mm", "paper_mm", "farthest_mm")]
        errors += [f"{row[f'random_{key}_mm']:.2f} mm" for key in ("mean", "median", "best")]
        lines.append((str(row["markers"]), *errors, f"{100 * row['random_worse']:.0f} %", " ".join(row["ours"])))
    return "\n".join([f"{name}: mean error at the markers left out", *aligned(lines, left=1, text=(8,))])

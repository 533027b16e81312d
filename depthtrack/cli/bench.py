"""`depthtrack bench`: how fast this machine is at it, beside what one would use instead."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from depthtrack.errors import DepthtrackError

_MODULES = {"score": "depthtrack.evaluation.bench.scoring"}
"""Where each benchmark lives: `plan(backends, seconds)` checks and counts, `run(plan, progress)` measures, and
`as_text(report)` tells it to people; the report, a dataclass, has `rows`, and none where nothing could run."""


@dataclass(frozen=True)
class Command:
    """Measure speed on this machine.

    score: from poses to energies, kinematics and objective included, in hypotheses a second, for every backend that
    runs here, at the sensor's resolution and at 96 and 64 pixels a side; and, where they are installed, for pyrender,
    Open3D and embree on a mesh of the same hand.
    """

    what: tyro.conf.Positional[Literal["score"]]
    """What to measure."""
    backends: Annotated[tuple[str, ...] | None, tyro.conf.arg(metavar="NAME ...")] = None
    """Only these, of raster, egl, osmesa, oracle, pyrender, open3d, embree; unless told, all but the slow oracle."""
    seconds: float = 1.0
    """Time spent on each row of the table; the best and the median call count."""
    json: bool = False
    """Print JSON instead of a table."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="FILE.json")] = None
    """Write the JSON to a file as well."""

    def run(self) -> None:
        from dataclasses import asdict
        from importlib import import_module
        from json import dumps

        from tqdm import tqdm

        benchmark = import_module(_MODULES[self.what])
        plan = benchmark.plan(self.backends, self.seconds)
        report = benchmark.run(
            plan, lambda rows: tqdm(rows, total=plan.row_count, unit="row", leave=False, disable=None)
        )
        text = dumps(asdict(report), indent=2)
        if self.out is not None:
            _write(self.out, text + "\n")
        print(text if self.json else benchmark.as_text(report))
        if not report.rows:
            raise DepthtrackError("nothing asked for can run here: the reasons are above")


def _write(path: Path, text: str) -> None:
    aside = path.with_name(path.name + ".part")
    try:
        aside.write_text(text, encoding="utf-8")
        aside.replace(path)
    finally:
        aside.unlink(missing_ok=True)

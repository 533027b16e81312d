"""Run each command with each numeric option at the ends of its range and beyond.

    python -m tests.robustness.option_matrix             # hours
    python -m tests.robustness.option_matrix info synth  # some commands

`options.json` states the commands, which run on tiny inputs. Exit codes must be 0, or 2 with one sentence; a value
beyond its range must give 2, and what is printed with --json must be strict JSON.
"""

import argparse
import json
import math
import shutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NoReturn, get_args

from tqdm import tqdm

from depthtrack.cli import COMMANDS, CommandEntry
from depthtrack.cli.markers import COMMANDS as MARKER_COMMANDS
from depthtrack.cli.stated_default import ShownDefault
from depthtrack.ranges import Range
from tests.robustness.acts import command, quiet
from tests.robustness.forked import Ended, run_forked
from tests.robustness.test_outputs import arguments_of, types_in

MATRIX: dict[str, Any] = json.loads((Path(__file__).parent / "options.json").read_text(encoding="utf-8"))
_KEPT = ("recording", "run", "capture")
_LIMIT = 120.0
"""Seconds of a command, which takes 5 s by default."""


@dataclass(frozen=True)
class Case:
    """A command with one option at an end of its range, or beyond.

    beyond: range of the option if it is beyond.
    """

    arguments: tuple[str, ...]
    beyond: Range | None = None

    def problem(self, ended: Ended) -> str | None:
        """Return what is wrong with the end of the command, if anything."""
        # The refusal must be that of the range, and of no other argument.
        is_refused = ended.code == 2 and f"must be {self.beyond}, found " in ended.error
        if not ended.is_orderly or (self.beyond is not None and not is_refused):
            return f"ended with {ended.code}: {ended.error[-300:]}"
        if ended.code == 0 and "--json" in self.arguments and not _is_strict(ended.output):
            return "printed no strict JSON"
        return None


def cases(name: str) -> Iterator[Case]:
    """Yield the cases of a command of the matrix."""
    base = (MATRIX["commands"] | MATRIX["refused_before_work"])[name]
    runs = name in MATRIX["commands"]
    if runs:
        yield Case(tuple(base))
    for flag, numbers, found in _options(name):
        short = flag.rpartition(".")[2].removeprefix("--")
        ends = [(found.least - max(1, abs(found.least)), True)]
        if math.isfinite(found.most):
            ends.append((found.most + max(1, abs(found.most)), True))
            if runs and short not in MATRIX["costly_at_most"]:
                ends.append((found.most, False))
        if runs and short not in MATRIX["costly_at_least"]:
            ends.append((found.least, False))
        for value, is_beyond in ends:
            # Whole numbers above 2^53 have no exact float.
            text = str(value) if isinstance(value, int) else f"{value:.17g}"
            yield Case((*base, flag, *[text] * numbers), found if is_beyond else None)


def _options(name: str) -> Iterator[tuple[str, int, Range]]:
    """Yield the long name, the count of values and the range of each number of a command."""
    entry = entries()[name]
    module = import_module(entry.module)
    kind = module.command([])[0] if hasattr(module, "command") else module.Command
    for field, hint in arguments_of(kind):
        marks = getattr(hint, "__metadata__", ())
        for mark in marks:
            shown = getattr(mark, "help_behavior_hint", None)
            if isinstance(shown, ShownDefault) and shown.range is not None:
                yield f"--{mark.name or field.replace('_', '-')}", _values(hint), shown.range


def _values(hint: Any) -> int:
    """Return how many values an option takes; one of lists of any length."""
    tuples = [get_args(each) for each in types_in(hint) if getattr(each, "__origin__", None) is tuple]
    return len(tuples[0]) if tuples and Ellipsis not in tuples[0] else 1


def entries() -> dict[str, CommandEntry]:
    """Return all commands but groups, by their whole names."""
    plain = {name: entry for name, entry in COMMANDS.items() if name not in ("markers", "synergies", "bench")}
    return plain | {f"markers {name}": entry for name, entry in MARKER_COMMANDS.items()}


def _is_strict(text: str) -> bool:
    def refuse(constant: str) -> NoReturn:
        raise ValueError(constant)

    try:
        json.loads(text, parse_constant=refuse)
    except ValueError:
        return False
    return True


def run(names: list[str], show: Callable[[str], None] = print) -> int:
    """Run the cases of some commands, print a table, and return the number of faults."""
    faults = 0
    with TemporaryDirectory() as folder:
        place = Path(folder)
        for arguments in MATRIX["prepare"]:
            quiet(command, arguments, place)
        show(f"{'command':24}{'cases':>8}{'faults':>8}")
        for name in names:
            if name in MATRIX["commands"]:
                _clear(place)
                quiet(command, MATRIX["commands"][name], place)  # compiles and loads what the children need
            tried = list(cases(name))
            found = [problem for case in tqdm(tried, name, disable=None) if (problem := _problem(case, place))]
            show("\n".join([f"{name:24}{len(tried):>8}{len(found):>8}", *found]))
            faults += len(found)
    return faults


def _problem(case: Case, place: Path) -> str | None:
    """Run a case, and return a line about what is wrong, if anything."""
    _clear(place)
    ended = run_forked(list(case.arguments), place, limit=_LIMIT)
    problem = case.problem(ended)
    return None if problem is None else f"    {' '.join(case.arguments)}: {problem}"


def _clear(place: Path) -> None:
    for path in place.iterdir():
        if path.name not in _KEPT:
            shutil.rmtree(path) if path.is_dir() else path.unlink()


def main() -> int:
    parser = argparse.ArgumentParser(description="Run commands with options at the ends of their ranges and beyond.")
    known = [*MATRIX["refused_before_work"], *MATRIX["commands"]]
    parser.add_argument("names", nargs="*", choices=[*known, []], help="commands; all if none")
    return 1 if run(parser.parse_args().names or known) else 0


if __name__ == "__main__":
    sys.exit(main())

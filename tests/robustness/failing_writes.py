"""Let every write, fsync and rename of the commands fail, one after the other, and look at what is left.

    python -m tests.robustness.failing_writes            # every operation, each way to fail
    python -m tests.robustness.failing_writes --short    # the writers alone

After each failure, the output is the old one or the whole new one, or a run that the next call completes to the same
bits. Hidden files of a killed process may be left. Exit code 1 if there was one that is not.
"""

import argparse
import csv
import shutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.robustness.acts import command, quiet, write_file, write_recording, write_run
from tests.robustness.file_faults import FAULTS, Fault, FaultyDisk
from tests.robustness.forked import Ended, run_forked

Contents = dict[str, bytes]
"""Files below a folder, by relative path."""
_TIMES = {"timings.csv", "results.json", "results.csv", "report.html", "budgets.jsonl", "run.json", "done.json"}
"""Files that hold times, which differ between equal runs."""
_INPUTS = {
    "recording": ("synth", "everyday", "recording", "--frames", "2", "--model", "skin"),
    "run": ("track", "recording", "-o", "run", "--hand", "truth", "--tracker", "ik", "--threads", "1"),
    "moving": ("synth", "everyday", "moving", "--frames", "8", "--fps", "6", "--model", "skin"),
    "capture": ("synth", "everyday", "capture", "--markers", "13", "--frames", "8"),
}
"""Commands that make the inputs, by name."""


@dataclass(frozen=True)
class Scenario:
    """A command whose writes fail.

    arguments: of the command, which writes to OUT.
    again: arguments that complete what a failure left; those of the command if empty.
    resumes: whether OUT is a folder that the next call completes; else OUT is old or new.
    old: whether OUT exists before the command.
    act: what the arguments are given to.
    """

    name: str
    arguments: tuple[str, ...]
    again: tuple[str, ...] = ()
    resumes: bool = False
    old: bool = False
    act: Callable[[list[str]], int] = command


@dataclass
class Tally:
    """What became of the failures of one scenario."""

    operations: int = 0
    runs: int = 0
    kills: int = 0
    faults: list[str] | None = None

    def row(self, name: str) -> str:
        """Return a line of the table."""
        return f"{name:24}{self.operations:>12}{self.runs:>8}{self.kills:>8}{len(self.faults or ()):>10}"


def scenarios(short: bool) -> list[Scenario]:
    """Return the writers alone if `short`, else the commands."""
    if short:
        return [
            Scenario("recording", ("OUT", "2"), old=True, act=write_recording),
            Scenario("run", ("OUT",), resumes=True, act=write_run),
            Scenario("file", ("OUT.txt",), old=True, act=write_file),
        ]
    synth = ("synth", "everyday", "OUT", "--frames", "2", "--threads", "1")
    track = ("track", "recording", "-o", "OUT", "--hand", "truth", "--tracker", "ik", "--threads", "1")
    compare = ("compare", "recording", "-o", "OUT", "--hand", "truth", "--trackers", "ik", "--jobs", "1")
    exports = [
        Scenario(f"export {name}", ("export", "run", "-o", f"OUT{suffix}", "--format", name), old=True)
        for name, suffix in sorted(_exported().items())
    ]
    capture = ("capture/capture.csv", "-o")
    return [
        Scenario("synth", (*synth, "--model", "skin", "--sensor", "kinect1", "--background", "room", "--keypoints")),
        Scenario("synth --overwrite", (*synth, "--seed", "1", "--overwrite"), old=True),
        Scenario("track", track, (*track, "--resume"), resumes=True),
        Scenario("compare", compare, resumes=True),
        Scenario("convert", ("convert", "recording", "OUT")),
        Scenario("convert .mcap", ("convert", "recording", "OUT.mcap")),
        Scenario("calibrate", ("calibrate", "moving", "-o", "OUT"), old=True),
        *exports,
        Scenario("markers link .csv", ("markers", "link", *capture, "OUT.csv"), old=True),
        Scenario("markers cut .c3d", ("markers", "cut", *capture, "OUT.c3d", "--frames", "2", "3"), old=True),
        Scenario("markers cut .trc", ("markers", "cut", *capture, "OUT.trc", "--frames", "2", "3"), old=True),
        Scenario("markers label", ("markers", "label", *capture, "OUT", "-m", "13")),
        Scenario("markers model", ("markers", "model", *capture, "OUT", "--body", "{labels}"), old=True),
        Scenario("synth --markers", ("synth", "everyday", "OUT", "--markers", "13", "--frames", "4", "--seed", "3")),
    ]


def _exported() -> dict[str, str]:
    """Return a suffix of each format that a run of depth images can be written to without other libraries."""
    from depthtrack.export.registry import EXPORTERS

    return {name: exporter.suffixes[0] for name, exporter in EXPORTERS.items()}


class Campaign:
    """All failures of all scenarios, in a folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def run(self, scenario: Scenario) -> Tally:
        """Let each operation of a command fail in each way."""
        self._make_inputs(scenario.arguments)
        scenario = replace(scenario, arguments=tuple(self._filled(scenario.arguments)))
        reference, operations = self._reference(scenario)
        tally = Tally(operations=len(operations), faults=[])
        for fault in FAULTS:
            for at in range(1, len(operations) + 1):
                self._prepare(scenario)
                before = contents(self._folder)
                ended = self._forked(scenario, scenario.arguments, fault, at)
                tally.runs += 1
                tally.kills += ended.code == -9
                for found in self._problems(scenario, fault, ended, before, reference):
                    tally.faults = [*(tally.faults or ()), f"{fault} at {at}, {operations[at - 1]}: {found}"]
        return tally

    def _make_inputs(self, arguments: tuple[str, ...]) -> None:
        """Make the inputs that arguments name, and those of them in turn."""
        for part in arguments:
            name = part.partition("/")[0]
            if name in _INPUTS and not (self._folder / name).exists():
                self._make_inputs(tuple(each for each in _INPUTS[name] if each != name))
                self._here(Scenario("", _INPUTS[name]))

    def _reference(self, scenario: Scenario) -> tuple[Contents, list[str]]:
        """Return what the command writes if nothing fails, and its operations."""
        self._prepare(scenario)
        self._here(scenario)  # compiles and loads what the children need
        self._prepare(scenario)
        disk = FaultyDisk(self._folder)
        with disk.installed():
            self._here(scenario)
        return self._output(scenario), disk.operations

    def _problems(
        self, scenario: Scenario, fault: Fault, ended: Ended, before: Contents, reference: Contents
    ) -> Iterator[str]:
        # A full disk still renames, so that the last operation may succeed.
        expected = {"full": (2, 0), "broken": (2,), "short": (0,), "killed": (-9,)}[fault]
        if ended.code not in expected or (2 in expected and not ended.is_orderly):
            yield f"ended with {ended.code} in place of {expected}: {ended.error[-300:]}"
        hidden = [name for name in contents(self._folder) if name not in before and "/." in f"/{name}"]
        if fault != "killed" and hidden:
            yield f"left {hidden}"
        found = self._output(scenario)
        if scenario.resumes:
            again = scenario.again if (self._folder / "OUT" / "run.json").exists() else scenario.arguments
            ended = self._forked(scenario, again or scenario.arguments, "none", 0)
            found = self._output(scenario)
            if ended.code != 0:
                yield f"does not resume: {ended.code} {ended.error[-300:]}"
        old = {name: data for name, data in before.items() if name.startswith("OUT")}
        # Each output is complete, of a command that writes several.
        for output in {name.partition("/")[0] for name in found | old | reference}:
            left, former, new = (_of(output, each) for each in (found, old, reference))
            if left != new and (scenario.resumes or ended.code == 0 or left != former):
                yield f"left {output}, which is neither the old nor the new one"

    def _prepare(self, scenario: Scenario) -> None:
        """Remove what the last command left, and make what the command replaces."""
        for path in self._folder.iterdir():
            if path.name not in _INPUTS:
                shutil.rmtree(path) if path.is_dir() else path.unlink()
        if not scenario.old:
            return
        (out,) = {part for part in scenario.arguments if part.startswith("OUT")}
        if scenario.name.startswith("synth"):
            self._make_inputs(("recording",))
            shutil.copytree(self._folder / "recording", self._folder / out)
        elif scenario.act is write_recording:
            quiet(write_recording, ["OUT", "1"], self._folder)
        else:
            (self._folder / out).write_text("old")

    def _output(self, scenario: Scenario) -> Contents:
        """Return the visible files of the output without those that hold times."""
        found = {name: data for name, data in contents(self._folder).items() if "/." not in f"/{name}"}
        return {
            name: data
            for name, data in found.items()
            if name.startswith("OUT") and not (scenario.resumes and Path(name).name in _TIMES)
        }

    def _filled(self, arguments: tuple[str, ...]) -> Iterator[str]:
        for part in arguments:
            if part == "{labels}":
                with (self._folder / "capture" / "capture.csv").open(encoding="utf-8") as file:
                    header = next(csv.reader(file))
                names = dict.fromkeys(name.rpartition("-")[0] for name in header if name.endswith("-X"))
                yield from list(names)[:3]
            else:
                yield part

    def _forked(self, scenario: Scenario, arguments: tuple[str, ...], fault: Fault, at: int) -> Ended:
        return run_forked(
            list(arguments), self._folder, FaultyDisk(self._folder, fault, at).installed, act=scenario.act
        )

    def _here(self, scenario: Scenario) -> None:
        """Act in this process, whose memory the children share.

        Raises:
            RuntimeError: it failed.
        """
        if code := quiet(scenario.act, list(scenario.arguments), self._folder):
            raise RuntimeError(f"{' '.join(scenario.arguments)} ended with {code}")


def _of(output: str, found: Contents) -> Contents:
    """Return the files of one output."""
    return {name: data for name, data in found.items() if name.partition("/")[0] == output}


def contents(folder: Path) -> Contents:
    """Return all files below a folder."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def run(short: bool, names: list[str], show: Callable[[str], None] = print) -> bool:
    """Run the campaign, print its table, and return whether no fault was found.

    names: of the scenarios; all if empty.
    """
    found = False
    with TemporaryDirectory() as folder:
        campaign = Campaign(Path(folder))
        show(f"{'command':24}{'operations':>12}{'runs':>8}{'kills':>8}{'faults':>10}")
        for scenario in scenarios(short):
            if names and scenario.name not in names:
                continue
            tally = campaign.run(scenario)
            show(tally.row(scenario.name))
            for fault in tally.faults or ():
                show(f"    {fault}")
                found = True
    return not found


def main() -> int:
    parser = argparse.ArgumentParser(description="Let the writes of commands fail.")
    parser.add_argument("--short", action="store_true", help="the writers alone")
    parser.add_argument("names", nargs="*", help="commands as the table names them; all if none")
    given = parser.parse_args()
    return 0 if run(given.short, given.names) else 1


if __name__ == "__main__":
    sys.exit(main())

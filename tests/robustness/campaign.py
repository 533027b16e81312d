"""Change files of every reader at random, and count what the readers do.

`python -m tests.robustness.campaign --help` lists the options. The changes follow from the seed. A file that ends a
reader otherwise than by a result or one sentence is kept below `--faults`.
"""

import argparse
import os
import shutil
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from depthtrack.text_table import aligned
from tests.robustness.images import change_png
from tests.robustness.limits import FaultError, Outcome, memory_limit, outcome
from tests.robustness.mutations import BINARY, JSON, TEXT, ZIP, Mutation
from tests.robustness.readers import READERS, Reader

KINDS: dict[str, tuple[Mutation, ...]] = {
    **dict.fromkeys((".json", ".gltf"), JSON),
    **dict.fromkeys((".txt", ".csv", ".toml", ".tsv", ".trc", ".yml", ".yaml", ".jsonl"), TEXT),
    **dict.fromkeys((".npz", ".r3d"), ZIP),
    ".png": (change_png, change_png, *BINARY),
}
"""Mutations by suffix; those of binary files for others."""
NO_FILES: dict[str, Callable[[Path], None]] = {
    "nothing": lambda path: None,
    "a folder": lambda path: path.mkdir(),
    "a pipe": lambda path: os.mkfifo(path),
    "a loop of links": lambda path: path.symlink_to(path.name),
    "a device without an end": lambda path: path.symlink_to("/dev/zero"),
}
"""What stands in the place of a file."""


@dataclass(frozen=True)
class Kept:
    """A file that ended a reader otherwise than by a result or its error."""

    reader: str
    number: int
    file: str
    fault: str


class Changer:
    """Changes one file of a reader's sample at a time; the sample is whole in between."""

    def __init__(self, reader: Reader, folder: Path) -> None:
        self.reader, self.path = reader, reader.make(folder)
        root = self.path if self.path.is_dir() else self.path.parent
        patterns = reader.only or ("*",)
        files = sorted({path for pattern in patterns for path in root.rglob(pattern) if path.is_file()})
        self.root, self.files = root, [path for path in files if "unused" not in path.parts]
        self.whole = reader.read(self.path)

    def attempt(self, seed: int) -> Outcome:
        """Return the outcome of the change of this seed. Raises FaultError."""
        rng, path = self._chosen(seed)
        data = path.read_bytes()
        is_text = path.suffix in ("", ".mat") and b"\0" not in data
        kinds = TEXT if is_text else KINDS.get(path.suffix, BINARY)
        path.write_bytes(kinds[int(rng.integers(len(kinds)))](data, rng))
        try:
            return outcome(self.reader.read, self.path, self.whole)
        except FaultError as fault:
            fault.add_note(str(path))
            fault.data = path.read_bytes()
            raise
        finally:
            path.write_bytes(data)

    def replace(self, kind: str, seed: int) -> Outcome:
        """Return the outcome with one of `NO_FILES` in the place of a file. Raises FaultError."""
        _, path = self._chosen(seed)
        data = path.read_bytes()
        path.unlink()
        NO_FILES[kind](path)
        try:
            return outcome(self.reader.read, self.path, self.whole)
        except FaultError as fault:
            fault.add_note(str(path))
            fault.data = kind.encode()
            raise
        finally:
            if path.is_dir():
                path.rmdir()
            path.unlink(missing_ok=True)
            path.write_bytes(data)

    def _chosen(self, seed: int) -> tuple[np.random.Generator, Path]:
        rng = np.random.default_rng([seed, *self.reader.name.encode()])
        return rng, self.files[int(rng.integers(len(self.files)))]


def run(reader: Reader, seeds: range, faults: Path | None = None) -> tuple[Counter[str], list[Kept]]:
    """Return the number of each outcome, and the faults; their files are copied.

    Each seed changes a file, and each of `NO_FILES` replaces one.
    """
    counts: Counter[str] = Counter()
    kept: list[Kept] = []
    with TemporaryDirectory() as name:
        changer = Changer(reader, Path(name))
        with memory_limit():
            attempts = [(seed, partial(changer.attempt, seed)) for seed in seeds]
            attempts += [(seeds.start, partial(changer.replace, kind, seeds.start)) for kind in NO_FILES]
            for seed, attempt in attempts:
                try:
                    counts[attempt()] += 1
                except FaultError as fault:
                    counts["fault"] += 1
                    file = Path(fault.__notes__[0]).relative_to(changer.root)
                    kept.append(Kept(reader.name, seed, str(file), str(fault)))
                    if faults is not None:
                        place = faults / reader.name.replace(" ", "-").replace(",", "") / f"{seed}-{file.name}"
                        place.parent.mkdir(parents=True, exist_ok=True)
                        place.write_bytes(fault.data)
    return counts, kept


def table(rows: dict[str, Counter[str]]) -> Iterator[str]:
    """Yield a table of outcomes by reader, with a last line of sums."""
    names = (*(each.value for each in Outcome), "fault")
    total = sum(rows.values(), Counter[str]())
    lines = [[reader, *(str(counts[name]) for name in names)] for reader, counts in (*rows.items(), ("all", total))]
    yield from aligned([["reader", *names], *lines], left=1)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=2000, help="changed files of each reader")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--only", default="", help="part of the names of readers")
    parser.add_argument("--faults", type=Path, default=Path("out/robustness"), help="folder for files that are faults")
    chosen = parser.parse_args()
    shutil.rmtree(chosen.faults, ignore_errors=True)
    rows: dict[str, Counter[str]] = {}
    kept: list[Kept] = []
    for reader in READERS:
        if chosen.only not in reader.name or not reader.is_installed:
            continue
        begun = time.process_time()
        count = max(1, chosen.inputs // 10) if reader.slow else chosen.inputs
        rows[reader.name], found = run(reader, range(chosen.first, chosen.first + count), chosen.faults)
        kept += found
        seconds = time.process_time() - begun
        print(f"{reader.name}: {dict(rows[reader.name])}, {seconds:.1f} s", file=sys.stderr, flush=True)
        for each in found[:5]:
            print(f"  {each}", file=sys.stderr, flush=True)
    print("\n".join(table(rows)))
    return 1 if kept else 0


if __name__ == "__main__":
    sys.exit(main())

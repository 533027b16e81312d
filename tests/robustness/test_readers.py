"""Changed files of every reader are read or refused in one sentence, within limits.

The long form is `make robustness`. A file that was a fault once is kept in `faults/`.
"""

import inspect
import os
import shutil
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import pytest

from depthtrack.recording import sequences
from depthtrack.recording.sequences.base import BaseSequence
from tests.robustness.campaign import NO_FILES, Changer, run
from tests.robustness.limits import FaultError, Outcome, memory_limit, outcome, time_limit
from tests.robustness.readers import READERS, Reader

TRIALS, SLOW_TRIALS = 12, 2
"""Changed files of each reader."""
FAULTS = Path(__file__).parent / "faults"
FIRST = 1_000_000
"""First seed; the long form begins at 0."""


def readers() -> list[object]:
    skipped = pytest.mark.skip(reason="the optional library is not installed")
    return [pytest.param(each, id=each.name, marks=() if each.is_installed else skipped) for each in READERS]


@pytest.mark.parametrize("reader", readers())
def test_changed_files_are_read_or_refused(reader: Reader) -> None:
    trials = SLOW_TRIALS if reader.slow else TRIALS
    counts, kept = run(reader, range(FIRST, FIRST + trials))
    assert kept == []
    assert sum(counts.values()) == trials + len(NO_FILES)


@pytest.mark.parametrize("path", sorted(FAULTS.rglob("*.*")), ids=lambda path: f"{path.parent.name}/{path.name}")
def test_former_faults_are_read_or_refused(path: Path, tmp_path: Path) -> None:
    """The name of a kept file ends in that of the file of the sample that it replaces."""
    reader = next(each for each in READERS if each.name.replace(" ", "-").replace(",", "") == path.parent.name)
    if not reader.is_installed:
        pytest.skip("the optional library is not installed")
    changer = Changer(reader, tmp_path)
    (replaced,) = (file for file in changer.files if path.name.endswith(f"-{file.name}"))
    shutil.copyfile(path, replaced)
    with memory_limit():
        assert outcome(reader.read, changer.path, changer.whole) in Outcome


def test_every_format_of_recordings_has_a_sample(tmp_path: Path) -> None:
    """A new format needs an entry in `tests/robustness/readers.py`."""
    formats = set()
    for module in iter_modules(sequences.__path__):
        members = vars(import_module(f"{sequences.__name__}.{module.name}")).values()
        formats |= {each for each in members if inspect.isclass(each) and issubclass(each, BaseSequence)}
    formats = {each for each in formats - {BaseSequence} if not inspect.isabstract(each)}
    opened = set()
    for number, reader in enumerate(READERS):
        if reader.is_installed and "read_" in getattr(reader.read, "__name__", ""):
            folder = tmp_path / str(number)
            folder.mkdir()
            path = reader.make(folder)
            opened |= {each for each in formats if each.matches(path)}
    missing = {each for each in formats - opened if all(reader.is_installed for reader in READERS)}
    assert not missing


def test_limits_are_kept(tmp_path: Path) -> None:
    def endless(path: Path) -> int:
        while True:
            pass

    def large(path: Path) -> int:
        with memory_limit(1 << 27):
            return len(bytearray(1 << 30))

    def foreign(path: Path) -> int:
        raise RecursionError

    for read, message in ((large, "MemoryError"), (foreign, "RecursionError")):
        with pytest.raises(FaultError, match=message):
            outcome(read, tmp_path, 1)
    with pytest.raises(BaseException, match=r"^$"), time_limit(0.05):
        endless(tmp_path)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(BaseException, match=r"^$"), time_limit(2.0, waiting=0.05):
        (tmp_path / "pipe").open("rb")

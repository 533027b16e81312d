"""Test the help of options with a default that their help describes in words."""

from dataclasses import dataclass
from typing import Annotated

import pytest
import tyro

from depthtrack.cli.stated_default import stated_default


@dataclass
class Command:
    """Command with one option."""

    threads: Annotated[int | None, stated_default(metavar="N")] = None
    """Number of threads (default: one per core)."""
    source: Annotated[str, stated_default()] = ""
    """Origin (default: the names of the files)."""


@pytest.mark.parametrize(("default", "shown"), [(Command(), 0), (Command(threads=3), 1)])
def test_only_values_are_shown_beside_a_stated_default(
    default: Command, shown: int, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        tyro.cli(Command, args=["--help"], default=default)
    text = capsys.readouterr().out
    assert text.count("(default: ") == 2 + shown
    assert text.count("(default: 3)") == shown

"""Checks of all arguments of a command before its work: ranges, inputs and outputs."""

import dataclasses
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_type_hints

import tyro

from depthtrack.cli.stated_default import ShownDefault
from depthtrack.outputs import check_distinct, check_file, check_folder, check_input


@dataclass(frozen=True)
class Output:
    """Mark of an argument that names what a command writes.

    kind: a file, a folder, or a recording: a folder that may hold one, or a file with one of the suffixes.
    suffixes: of a file; any if empty.
    """

    kind: Literal["file", "folder", "recording"]
    suffixes: tuple[str, ...] = ()

    def check(self, path: Path, name: str) -> None:
        """Check that the output can be written.

        name: of the argument.

        Raises:
            InputError: if it cannot.
        """
        if self.kind == "file" or path.suffix.lower() in self.suffixes:
            check_file(path, name, self.suffixes)
        else:
            check_folder(path, name, recording=self.kind == "recording")


OUTPUT_FILE = Output("file")
OUTPUT_FOLDER = Output("folder")
PICTURE = Output("file", (".png", ".jpg", ".jpeg"))
VIDEO = Output("file", (".mp4", ".webm"))
CAPTURE = Output("file", (".csv", ".c3d", ".trc"))


def check_arguments(command: Any) -> None:
    """Check the arguments of a parsed command.

    Raises:
        InputError: a number is out of its range. An input is a loop of links, or no file can have its name. An output
            cannot be written, or is an input or another output.
    """
    outputs, inputs = {}, []
    for argument in _arguments(command):
        for mark in argument.marks:
            shown = getattr(mark, "help_behavior_hint", None)
            if isinstance(shown, ShownDefault) and shown.range is not None:
                shown.range.check(argument.value, argument.name)
        marks = [each for each in argument.marks if isinstance(each, Output)]
        if marks and isinstance(argument.value, Path):
            marks[0].check(argument.value, argument.name)
            outputs[argument.name] = argument.value
        else:
            values = argument.value if isinstance(argument.value, tuple) else (argument.value,)
            inputs += [Path(value) for value in values if isinstance(value, Path) or _is_link(value)]
    for each in inputs:
        check_input(each)
    check_distinct(outputs, inputs)


def _is_link(value: Any) -> bool:
    """Return whether a text, such as the name of a hand or its file, is a link."""
    return isinstance(value, str) and os.path.islink(value)


@dataclass(frozen=True)
class _Argument:
    """An argument: its name on the command line, its value, and what annotates its type."""

    name: str
    value: Any
    marks: tuple[Any, ...]


def _arguments(command: Any) -> Iterator[_Argument]:
    """Yield the arguments of a command and of the groups in it."""
    hints = get_type_hints(type(command), include_extras=True)
    for field in dataclasses.fields(command):
        value = getattr(command, field.name)
        if dataclasses.is_dataclass(value):
            yield from _arguments(value)
        else:
            marks = getattr(hints[field.name], "__metadata__", ())
            yield _Argument(_name(field.name, marks), value, marks)


def _name(field: str, marks: tuple[Any, ...]) -> str:
    """Return the short name of an argument, such as -o, or its long one."""
    aliases = [alias for mark in marks for alias in getattr(mark, "aliases", None) or ()]
    names = [mark.name for mark in marks if getattr(mark, "name", None)]
    short = [alias for alias in aliases if len(alias) == 2]
    if tyro.conf.Positional in marks:
        return next((mark.metavar for mark in marks if getattr(mark, "metavar", None)), field.upper())
    return short[0] if short else f"--{names[0] if names else field.replace('_', '-')}"

"""Whether a run may begin in a folder or go on there, with the same configuration."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from depthtrack.errors import InputError
from depthtrack.recording.run_rows import ROW_COLUMNS

_DESCRIBED = {"hand": "another hand (--hand, --side)", "reading": "other options of reading, such as --depth-scale"}
"""Words for entries of the configuration whose values say little."""


def check_unused(folder: Path, resume: bool) -> None:
    """Check that a folder holds no run, unless it is resumed.

    Raises:
        InputError: if it holds one, or poses whose `run.json` is missing.
    """
    if (folder / "run.json").exists():
        if not resume:
            raise InputError(f"{folder} already holds a run: continue it with --resume, or choose another folder")
    elif (folder / "poses.csv").exists() and not _is_empty_table(folder / "poses.csv"):
        raise InputError(f"{folder} holds a poses.csv without a run.json: choose another folder")


def _is_empty_table(path: Path) -> bool:
    """Return whether a table of poses has no row: its run ended before the first frame."""
    header = (",".join(ROW_COLUMNS) + "\r\n").encode()
    with path.open("rb") as file:
        return header.startswith(file.read(len(header) + 1))


def check_same(found: Mapping[str, Any], wanted: Mapping[str, Any], folder: Path) -> None:
    """Check that a run is resumed with its configuration, except threads, versions and machine.

    A run that refuses damaged frames may go on without them: the frames before are the same.

    Raises:
        InputError: if another entry differs; it names the first one.
    """
    # The tracker first, since its options follow from it, and the backward pass last, which follows from them.
    for key in sorted(set(found) | set(wanted), key=lambda key: (key != "tracker", key == "backward", key)):
        if key == "on_damage" and wanted.get(key) == "skip":
            continue
        if key not in ("versions", "threads", "machine") and found.get(key) != wanted.get(key):
            name, before, now = _first_difference(key, found.get(key), wanted.get(key))
            if key == "backward" and None in (before, now):
                given, other = ("no", "yes") if before is None else ("yes", "no")
                raise InputError(f"{folder} was begun with --backward {given}, not {other}: continue with the same")
            if key in _DESCRIBED:
                raise InputError(
                    f"{folder} was begun with {_DESCRIBED[key]}: continue with the same, or choose another folder"
                )
            raise InputError(
                f"{folder} was begun with {name} = {before!r:.80}, not {now!r:.80}: "
                "continue with the same options, or choose another folder"
            )


def _first_difference(name: str, found: Any, wanted: Any) -> tuple[str, Any, Any]:
    """Return the dotted name of the first nested entry that differs, with both values."""
    if isinstance(found, Mapping) and isinstance(wanted, Mapping):
        for key in sorted(set(found) | set(wanted)):
            if found.get(key) != wanted.get(key):
                return _first_difference(f"{name}.{key}", found.get(key), wanted.get(key))
    return name, found, wanted

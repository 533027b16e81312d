"""Files and folders to write: checks before the work, and a lock of a folder during it."""

import os
import stat
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from depthtrack.errors import InputError

_SOURCES = {
    "run.json": {"run.json", "poses.csv", "forward.csv", "timings.csv", "branches.csv", "failures.csv"},
    "depth.txt": {"depth.txt", "rgb.txt", "camera.json", "hand.json", "hand_poses.csv", "joints.csv", "keypoints.csv"},
    "markers.json": {"markers.json", "confidence.csv", "residual.csv", "filled.csv"},
}
"""Files of a run, a recording and a marker folder, by the file that marks such a folder."""


def check_file(path: Path, name: str = "-o", suffixes: tuple[str, ...] = ()) -> None:
    """Check that a file can be written: a new one, or one in place of a regular file.

    name: of the option, for errors.
    suffixes: those that the file may have; any if empty.

    Raises:
        InputError: the name has another suffix; the parent is no writable folder; or the path is a folder, a device, a
            pipe, a loop of links, a write-protected file, or a file of a run, a recording or a marker folder.
    """
    if path.name in ("", ".."):
        raise InputError(f"{name} must be the name of a file, found '{path}': name a file to write")
    if suffixes and path.suffix.lower() not in suffixes:
        raise InputError(f"{name} must end in {', '.join(suffixes)}, found '{path.name}': choose another name")
    found = _mode(path, name)
    if found is not None and not stat.S_ISREG(found):
        raise InputError(f"{name} must be a file, found the {_kind(found)} {path}: choose another name")
    target = Path(os.path.realpath(path))
    if found is not None:
        if any(path.name in names and (path.parent / mark).exists() for mark, names in _SOURCES.items()):
            raise InputError(f"{name} must not replace {path}, which belongs to the data in its folder: choose another")
        if not os.access(target, os.W_OK):
            raise InputError(f"{name} must be writable, but {path} is write-protected: choose another name")
    if not target.parent.is_dir():
        raise InputError(f"cannot write {path}: the folder {target.parent} does not exist: create it first")
    _check_writable(target.parent, path, name)


def check_folder(path: Path, name: str = "-o", recording: bool = False) -> None:
    """Check that a folder can be made or written to, and holds no recording.

    name: of the option, for errors.
    recording: whether it may hold one, which is replaced.

    Raises:
        InputError: the path is `.`, or it or a folder that contains it is a file, a device, a loop of links or not
            writable; or it holds a recording.
    """
    if path.name in ("", ".."):
        raise InputError(f"{name} must be the name of a folder, found '{path}': give its name, or its whole path")
    for folder in (path, *path.parents):
        found = _mode(folder, name)
        if found is None:
            if folder.is_symlink():
                raise InputError(f"{name} must be a folder, found the broken link {folder}: choose another name")
            continue
        if not stat.S_ISDIR(found):
            raise InputError(f"{name} must be a folder, found the {_kind(found)} {folder}: choose another name")
        _check_writable(folder, path, name)
        break
    if not recording and (path / "depth.txt").exists():
        raise InputError(f"{name} must not be the folder of a recording, found {path}: choose another name")


def check_input(path: Path) -> None:
    """Check that a path can be followed; whether something is there is left to the reader.

    Raises:
        InputError: it is a loop of links or a pipe, or no file can have its name.
    """
    try:
        mode = path.stat().st_mode
    except (FileNotFoundError, NotADirectoryError, PermissionError):
        pass
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"cannot read {path}: {reason}: name a file or folder that exists") from error
    else:
        if stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode):
            raise InputError(f"cannot read {path}: it is a pipe: write its content to a file")


def check_distinct(outputs: dict[str, Path], inputs: list[Path]) -> None:
    """Check that outputs are neither inputs nor each other.

    outputs: path by the name of its option.

    Raises:
        InputError: two of the paths are the same.
    """
    names: dict[str, str] = {}
    for name, path in outputs.items():
        real = os.path.realpath(path)
        if real in names:
            raise InputError(f"{names[real]} and {name} must differ, found {path} for both: choose another name")
        names[real] = name
    for each in inputs:
        if (name := names.get(os.path.realpath(each), "")) and each.is_file():
            raise InputError(f"{name} must not be the input {each}: choose another name")


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold a folder for this process; the system frees it if the process ends in any way.

    Systems and file systems without locks of folders are used without one.

    Raises:
        InputError: another process holds the folder.
    """
    if sys.platform == "win32":  # which cannot lock a folder
        yield
        return
    import fcntl

    handle = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise InputError(
                f"another process is writing to {folder}: wait until it ends, or choose another folder"
            ) from error
        except OSError:  # a network file system without locks
            pass
        yield
    finally:
        os.close(handle)


def _mode(path: Path, name: str) -> int | None:
    """Return the type and permissions of what a path leads to; None if nothing is there."""
    try:
        return path.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{name} cannot be written: {path}: {reason}: choose another name") from error


def _kind(mode: int) -> str:
    if stat.S_ISDIR(mode):
        return "folder"
    if stat.S_ISREG(mode):
        return "file"
    return "pipe" if stat.S_ISFIFO(mode) else "socket" if stat.S_ISSOCK(mode) else "device"


def _check_writable(folder: Path, path: Path, name: str) -> None:
    """Check by trying: permissions do not state whether a file system is writable, or full."""
    try:
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"{name}: cannot write {path}: {folder}: {reason}: choose another folder") from error

"""Read files of bounded size and write files that are complete or absent."""

import ctypes
import errno
import os
import secrets
import shutil
import stat
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

from depthtrack.errors import InputError
from depthtrack.strict_data import exact_json_text, parse_json

Built = TypeVar("Built")

_LINE_WIDTH = 160
"""Columns within which `compact_json` keeps an object or a list on one line."""


def check_size(path: Path, largest: int) -> None:
    """Raise InputError if `path` is not a regular file of at most `largest` bytes."""
    if not os.path.isfile(path):  # pathlib raises OSError for a name that is too long
        raise InputError(f"{path} is missing or no regular file")
    size = path.stat().st_size
    if size > largest:
        raise InputError(f"{path} must be at most {largest:,} bytes long, found {size:,}")


def open_regular(path: Path) -> BinaryIO:
    """Open a regular file to read bytes. A pipe, which would wait for a writer, or a device is an OSError."""

    def opener(name: str, flags: int) -> int:
        handle = os.open(name, flags | getattr(os, "O_NONBLOCK", 0))
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            os.close(handle)
            raise OSError(errno.EINVAL, "it is no regular file", name)
        return handle

    return open(path, "rb", opener=opener)


def read_bounded(path: Path, largest: int) -> bytes:
    """Return the bytes of a regular file.

    Raises: InputError if the file is missing, unreadable, or longer than `largest` bytes.
    """
    check_size(path, largest)
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot read {path}: {_reason(error)}") from error


def read_text(path: Path, largest: int = 1 << 20) -> str:
    """Return the text of a UTF-8 file.

    Raises: InputError if the file is missing, unreadable, not UTF-8, or longer than `largest` bytes.
    """
    return "".join(read_lines(path, largest))


def read_lines(path: Path, largest: int) -> Iterator[str]:
    """Yield the lines of a UTF-8 file.

    Raises: InputError if the file is missing, unreadable, not UTF-8, or longer than `largest` bytes.
    """
    check_size(path, largest)
    try:
        # Some spreadsheets write a byte order mark, which is no part of the text.
        with path.open(encoding="utf-8-sig") as file:
            yield from file
    except OSError as error:
        raise InputError(f"cannot read {path}: {_reason(error)}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path} must be a text file, found bytes that are not UTF-8") from error


def read_json(
    path: Path, what: str, build: Callable[[Any], Built], largest: int = 1 << 20, made_by: str | None = None
) -> Built:
    """Return `build` of the parsed contents of a JSON file.

    `what` names the contents in errors ("the hand file"). `made_by` is a command that writes such a file.
    Raises: InputError if the file cannot be read, is not strict JSON, or `build` rejects it by an InputError, KeyError,
    TypeError, ValueError, AttributeError, IndexError or OverflowError.
    """
    try:
        text = read_text(path, largest)
    except InputError as error:
        raise InputError(f"cannot read {what}: {error}") from error
    hint = "" if made_by is None else f" (`{made_by}` writes such a file)"
    try:
        return build(parse_json(text))
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    except KeyError as error:
        raise InputError(f"{path}: the entry {error} is missing{hint}") from error
    except (ValueError, TypeError, AttributeError, IndexError, OverflowError) as error:
        raise InputError(f"cannot read {what} {path}: {error}{hint}") from error


def compact_json(value: Any) -> str:
    """Return strict JSON text in which every object and list that fits is on one line.

    Raises: ValueError if a number is not finite.
    """
    return _compact(value, indent=0, used=0) + "\n"


@contextmanager
def replace_atomically(path: Path) -> Iterator[Path]:
    """Yield a temporary path with the same suffix that replaces `path` if the block succeeds.

    The temporary file is removed if the block fails. If the block writes no file, `path` stays as it was. The file that
    a link leads to is replaced, not the link.
    Raises: InputError if the folder does not exist or the file cannot be written.
    """
    shown, path = path, Path(os.path.realpath(path))
    if not path.parent.is_dir():
        raise InputError(f"cannot write {shown}: the folder {path.parent} does not exist: create it first")
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        yield temporary
        if temporary.exists():
            _store(temporary)
            os.replace(temporary, path)
    except OSError as error:
        raise InputError(f"cannot write {shown}: {_reason(error)}") from error
    finally:
        temporary.unlink(missing_ok=True)


def write_atomic(path: Path, content: str | bytes) -> None:
    """Write a file that is complete or absent; text is written as UTF-8 without newline translation.

    Raises: InputError if the folder does not exist or the file cannot be written.
    """
    with replace_atomically(path) as temporary:
        temporary.write_bytes(content.encode() if isinstance(content, str) else content)


def _store(path: Path) -> None:
    """Wait until the contents of a file are on the disk: a renamed file must not be empty after a power failure."""
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def check_replaceable(folder: Path, mark: str, what: str, overwrite: bool) -> None:
    """Raise InputError if a folder cannot be written because something else is there.

    mark: name of a file in every folder of this kind; only such folders are ever replaced.
    what: name of the kind in errors ("a sequence folder").
    overwrite: whether one may be replaced.
    """
    if not folder.is_symlink() and (not folder.exists() or (folder.is_dir() and not any(folder.iterdir()))):
        return
    if not overwrite:
        raise InputError(f"{folder} exists already: choose another name, or use --overwrite (Python: overwrite=True)")
    if folder.is_symlink() or not (folder / mark).is_file():
        raise InputError(f"{folder} is not {what}, so it is not overwritten: choose another name")


def move_folder(work: Path, folder: Path) -> None:
    """Rename a complete folder `work` to `folder`, and delete what that replaces.

    On Linux, one of both is there at any time. Elsewhere, a process that is killed between two renames leaves the
    former folder under a hidden name.
    """
    if not folder.exists():
        work.rename(folder)
        return
    if _exchange(work, folder):
        shutil.rmtree(work)
        return
    replaced = work.with_name(work.name + "-replaced")
    folder.rename(replaced)
    try:
        work.rename(folder)
    except OSError:
        replaced.rename(folder)
        raise
    shutil.rmtree(replaced)


def _exchange(first: Path, second: Path) -> bool:
    """Exchange two names in one step; return whether the system can."""
    if sys.platform != "linux":
        return False
    rename = getattr(ctypes.CDLL(None), "renameat2", None)
    current, exchange = -100, 2  # AT_FDCWD, RENAME_EXCHANGE
    return rename is not None and rename(current, os.fsencode(first), current, os.fsencode(second), exchange) == 0


@contextmanager
def new_folder(folder: Path, mark: str, what: str, overwrite: bool) -> Iterator[Path]:
    """Yield a hidden empty folder that becomes `folder` if the block succeeds.

    It is deleted if the block fails. See `check_replaceable`.
    """
    folder = Path(os.path.abspath(folder))
    check_replaceable(folder, mark, what, overwrite)
    work = folder.parent / f".{folder.name}.writing-{os.getpid()}-{secrets.token_hex(4)}"
    try:
        work.mkdir(parents=True)
        yield work
        check_replaceable(folder, mark, what, overwrite)
        move_folder(work, folder)
    except OSError as error:
        raise InputError(f"cannot write {folder}: {_reason(error)}") from error
    finally:
        shutil.rmtree(work, ignore_errors=True)


def _reason(error: OSError) -> str:
    return error.strerror or str(error)


def _compact(value: Any, indent: int, used: int) -> str:
    """Return the text of a value that begins `used` columns from the left, its lines indented by `indent`."""
    line = exact_json_text(value)
    nested = isinstance(value, dict | list) and bool(value)
    if not nested or (indent > 0 and used + len(line) <= _LINE_WIDTH and not _holds_objects(value)):
        return line
    inner = " " * (indent + 2)
    if isinstance(value, dict):
        keys = [f"{inner}{exact_json_text(str(key))}: " for key in value]
        items = value.values()
    else:
        keys, items = [inner] * len(value), value
    entries = [key + _compact(item, indent + 2, len(key)) for key, item in zip(keys, items, strict=True)]
    opening, closing = "{}" if isinstance(value, dict) else "[]"
    return f"{opening}\n" + ",\n".join(entries) + f"\n{' ' * indent}{closing}"


def _holds_objects(value: Any) -> bool:
    items = value.values() if isinstance(value, dict) else value
    return any(isinstance(item, dict) for item in items)

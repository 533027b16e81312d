"""Text files from anywhere: regular files of bounded size, so that no absurd one fills the memory."""

from collections.abc import Iterator
from pathlib import Path

from depthtrack.errors import InputError


def read_text(path: Path, largest: int = 1 << 20) -> str:
    """All of a UTF-8 file of at most `largest` bytes. Raises InputError."""
    return "".join(read_lines(path, largest))


def read_lines(path: Path, largest: int) -> Iterator[str]:
    """Lines of a UTF-8 file of at most `largest` bytes, one at a time. Raises InputError."""
    check_size(path, largest)
    try:
        # The mark that some spreadsheets put before UTF-8 is no part of the text.
        with path.open(encoding="utf-8-sig") as file:
            yield from file
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path} must be a text file, found bytes that are not UTF-8") from error


def check_size(path: Path, largest: int) -> None:
    """Raise InputError unless `path` is a regular file of at most `largest` bytes."""
    if not path.is_file():
        raise InputError(f"{path} is missing or no regular file")
    size = path.stat().st_size
    if size > largest:
        raise InputError(f"{path} must be at most {largest:,} bytes long, found {size:,}")

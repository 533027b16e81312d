"""Files that are complete or absent."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from depthtrack.errors import InputError


@contextmanager
def written_aside(path: Path) -> Iterator[Path]:
    """A path to write to, which takes the name `path` when the block ends well and vanishes when it does not.

    Raises InputError where nothing can be written there.
    """
    if not path.parent.is_dir():
        raise InputError(f"the folder {path.parent} for {path.name} does not exist: create it first")
    aside = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        yield aside
        os.replace(aside, path)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from error
    finally:
        aside.unlink(missing_ok=True)

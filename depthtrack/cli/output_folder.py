"""Check folders to write to before the work starts."""

from pathlib import Path

from depthtrack.errors import InputError


def check_output_folder(path: Path, option: str = "-o") -> None:
    """Check that `path` is a folder or does not exist.

    Raises:
        InputError: if `path` is a file.
    """
    if path.exists() and not path.is_dir():
        raise InputError(f"{option} must be a folder, found the file {path}: choose another name")

"""Folders to write to, checked before any work is done."""

from pathlib import Path

from depthtrack.errors import InputError


def check_output_folder(path: Path, option: str = "-o") -> None:
    """Raise InputError where `path`, which is to be a folder, is a file."""
    if path.exists() and not path.is_dir():
        raise InputError(f"{option} must be a folder, {path} is a file")

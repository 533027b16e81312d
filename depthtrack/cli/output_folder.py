"""Check folders to write to before the work starts."""

from pathlib import Path

from depthtrack.errors import InputError


def check_output_folder(path: Path, option: str = "-o") -> None:
    """Check that `path` is a folder without a recording, or does not exist.

    Raises:
        InputError: if `path` or the folder that contains it is a file, or if it holds a recording.
    """
    for folder in (path, *path.parents):
        if folder.exists() and not folder.is_dir():
            raise InputError(f"{option} must be a folder, found the file {folder}: choose another name")
    if (path / "depth.txt").exists():
        raise InputError(f"{option} must not be the folder of a recording, found {path}: choose another name")

"""The data folders of the program, `sequences/` and `shaders/`."""

from pathlib import Path

from depthtrack.errors import InputError

_PACKAGE = Path(__file__).resolve().parent


def resource_folder(name: str) -> Path:
    """Return the data folder `name`: inside an installed package, or beside a checked-out one.

    Raises:
        InputError: if neither exists, because the installation is broken.
    """
    for folder in (_PACKAGE / name, _PACKAGE.parent / name):
        if folder.is_dir():
            return folder
    raise InputError(
        f"the folder '{name}' of depthtrack is missing beside {_PACKAGE}: "
        "reinstall with  pip install --force-reinstall depthtrack"
    )

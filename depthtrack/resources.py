"""The data folders that come with the program: `sequences/` and `shaders/`."""

from pathlib import Path

from depthtrack.errors import InputError

_PACKAGE = Path(__file__).resolve().parent


def resource_folder(name: str) -> Path:
    """Return the folder `name` inside an installed package (wheel), or beside the package in a checkout.

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

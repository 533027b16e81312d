"""What the program finds around it: data folders that travel with it (`sequences/`, `shaders/`), and cores."""

import os
from pathlib import Path

from depthtrack.errors import InputError

_PACKAGE = Path(__file__).resolve().parent


def resource_folder(name: str) -> Path:
    """Folder `name` inside an installed package (wheel), or beside the package in a checkout.

    Raises InputError when neither exists, which means a broken installation.
    """
    for folder in (_PACKAGE / name, _PACKAGE.parent / name):
        if folder.is_dir():
            return folder
    raise InputError(
        f"the folder '{name}' of depthtrack is missing beside {_PACKAGE}: "
        "reinstall with  pip install --force-reinstall depthtrack"
    )


def usable_cores() -> int:
    """Cores that this process may run on; where the system does not tell, all there are."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1

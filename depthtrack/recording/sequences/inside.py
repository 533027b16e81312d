"""Files that a recording names must lie within its folder."""

import os
from pathlib import Path


class Inside:
    """Checks that a listed name lies within a folder; follows the links of each directory once.

    It works on strings: a list has one name per frame, and path objects would take longer than reading the list.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = str(folder)
        self._root = Path(os.path.realpath(folder))
        self._directories: dict[str, bool] = {}

    def holds(self, name: str) -> bool:
        """Return whether `name` lies within the folder, links followed."""
        # Backslashes and drive letters leave the folder on Windows; control characters could steer a terminal.
        if (
            name.startswith("/")
            or name[1:2] == ":"
            or "\\" in name
            or ".." in name.split("/")
            or not name.isprintable()
        ):
            return False
        directory = name.rpartition("/")[0]
        if directory not in self._directories:
            self._directories[directory] = self._leads_inside(directory)
        is_link = os.path.islink(f"{self._folder}/{name}")
        return self._directories[directory] and (not is_link or self._leads_inside(name))

    def _leads_inside(self, name: str) -> bool:
        return Path(os.path.realpath(f"{self._folder}/{name}")).is_relative_to(self._root)


def is_inside(folder: Path, name: str) -> bool:
    """Return whether the file `name` of `folder` lies within it, links followed."""
    return Inside(folder).holds(name)

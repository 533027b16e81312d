"""The lists and images of a folder in the layout of TUM RGB-D, or of its relatives.

Depth and colour are listed in `depth.txt` and `rgb.txt` or `color.txt`, or together in `associations.txt`. Without a
list, the numbers in the names of the images order them. Upper and lower case do not matter.
"""

import os
import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from depthtrack.errors import InputError
from depthtrack.recording.sequences.inside import is_inside
from depthtrack.recording.sequences.tum_lists import (
    ImageList,
    columns_of,
    images_of,
    read_associations,
    read_list,
)

DEPTH_LIST = "depth.txt"
_COLOUR_LISTS = ("rgb.txt", "color.txt", "colour.txt")
_ASSOCIATIONS = ("associations.txt", "association.txt", "associated.txt", "associate.txt", "assoc.txt")
_DEPTH_FOLDERS = ("depth", "depths", "depth_images")
_COLOUR_FOLDERS = ("rgb", "color", "colour", "rgb_images", "color_images", "images", "image")
_DEPTH_PREFIXES, _COLOUR_PREFIXES = ("depth",), ("rgb", "color", "colour")
_IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg")
_NUMBER = re.compile(r"\d+(?:\.\d+)?")


@dataclass(frozen=True)
class FolderLists:
    """The images of a folder.

    colour: None without any.
    note: sentence for the user on where the images were found; None for the lists of TUM RGB-D.
    """

    depth: ImageList
    colour: ImageList | None
    note: str | None = None


def holds_images(folder: Path) -> bool:
    """Return whether a folder has a list of depth images, or numbered depth images."""
    if not folder.is_dir():
        return False
    return _first(folder, (DEPTH_LIST, *_ASSOCIATIONS)) is not None or bool(_numbered(folder, depth=True))


def find_lists(folder: Path) -> FolderLists:
    """Return the depth and colour images of a folder.

    Raises:
        InputError: if a list is malformed, or none and no numbered images are found.
    """
    depth, associations = _first(folder, (DEPTH_LIST,)), _first(folder, _ASSOCIATIONS)
    if depth is not None and columns_of(depth) == 2:
        depth, associations = None, depth
    if depth is None and associations is not None:
        return _from_associations(associations)
    if depth is None:
        return _without_lists(folder)
    images, colour = read_list(depth), _first(folder, _COLOUR_LISTS)
    if not images.files:
        raise InputError(f"{depth} lists no image: expected lines of the form 'timestamp filename'")
    note = None if colour is None or colour.name == _COLOUR_LISTS[0] else f"colour images are those of {colour.name}"
    return FolderLists(images, None if colour is None else _colour_list(colour), note)


def _colour_list(path: Path) -> ImageList | None:
    """Return the images of a list of colour; None if it lists none."""
    images = read_associations(path)[0] if columns_of(path) == 2 else read_list(path)
    return images if images.files else None


def _from_associations(path: Path) -> FolderLists:
    """Return the images of an association list; their names state which are depth."""
    first, second = read_associations(path)
    if not first.files:
        raise InputError(f"{path} lists no image: expected lines 'timestamp filename timestamp filename'")
    depths = [_is_depth(images) for images in (first, second)]
    if depths[0] == depths[1]:
        raise InputError(
            f"{path} must name the folder of the depth images depth, found {first.files[0].name!r:.60} and"
            f" {second.files[0].name!r:.60}: write depth.txt with lines 'timestamp filename'"
        )
    depth, colour = (first, second) if depths[0] else (second, first)
    return FolderLists(depth, colour, f"depth and colour images are those of {path.name}")


def _without_lists(folder: Path) -> FolderLists:
    """Return the images of a folder by the numbers in their names."""
    depth, colour = _numbered(folder, depth=True), _numbered(folder, depth=False)
    if not depth:
        raise InputError(
            f"{folder} must have {DEPTH_LIST} with lines 'timestamp filename', or images depth/NUMBER.png,"
            " found neither"
        )
    return FolderLists(
        images_of(folder, depth),
        images_of(folder, colour) if colour else None,
        f"no {DEPTH_LIST}: {len(depth)} depth images are ordered by the numbers in their names",
    )


def _is_depth(images: ImageList) -> bool:
    return "depth" in images.files[0].name.lower()


def _numbered(folder: Path, *, depth: bool) -> list[tuple[str, str, int]]:
    """Return (number, name, place) of the images of depth or colour, by folder or prefix."""
    for name in _DEPTH_FOLDERS if depth else _COLOUR_FOLDERS:
        inner = _first(folder, (name,))
        if inner is not None and inner.is_dir():
            found = _by_number(f"{inner.name}/{each}" for each in _names(inner))
            if found:
                return found
    prefixes = _DEPTH_PREFIXES if depth else _COLOUR_PREFIXES
    return _by_number(name for name in _names(folder) if name.lower().startswith(prefixes))


def _by_number(names: Iterable[str]) -> list[tuple[str, str, int]]:
    found = []
    for name in names:
        stem, suffix = os.path.splitext(name.rpartition("/")[2])
        numbers = _NUMBER.findall(stem)
        if suffix.lower() in _IMAGE_SUFFIXES and numbers:
            found.append((numbers[-1], name))
    found.sort(key=lambda each: (float(each[0]), each[1]))
    return [(number, name, place) for place, (number, name) in enumerate(found, start=1)]


def _first(folder: Path, names: Iterable[str]) -> Path | None:
    """Return the first of some entries of a folder, in upper or lower case; None without any."""
    for name in names:
        if (folder / name).exists():
            return folder / name
    entries = {name.lower(): name for name in reversed(_names(folder))}
    return next((folder / entries[name] for name in names if name in entries), None)


def _names(folder: Path) -> list[str]:
    try:
        return sorted(os.listdir(folder))
    except OSError as error:
        raise InputError(f"cannot read {folder}: {error.strerror}") from error


class ImageFiles:
    """Paths of listed images; a name in another case is found too."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._entries = cache(self._by_lower_case)

    def path(self, name: str) -> Path:
        """Return the path of a listed image, which may not exist."""
        path = self._folder / name
        if os.path.exists(path):
            return path
        entries = self._entries(name.lower().rpartition("/")[0])
        other = entries.get(name.lower())
        return path if other is None or not is_inside(self._folder, other) else self._folder / other

    def _by_lower_case(self, directory: str) -> dict[str, str]:
        """Return the names in a directory, given in lower case, by their lower case."""
        found: dict[str, str] = {}
        for inner in [""] if not directory else [name for name in _names(self._folder) if name.lower() == directory]:
            if (self._folder / inner).is_dir():
                prefix = f"{inner}/" if inner else ""
                found |= {f"{prefix}{name}".lower(): f"{prefix}{name}" for name in _names(self._folder / inner)}
        return found

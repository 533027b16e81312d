"""Folders of images as other tools write them, and what reading them gives."""

from collections.abc import Callable, Iterable
from pathlib import Path

from tests.support.recordings import write_sample

Change = Callable[[Path], object]


def stripped_sample(path: Path) -> Path:
    """Write the sample recording without ground truth, whose times would be others."""
    folder = write_sample(path)
    for name in ("hand_poses.csv", "joints.csv", "hand.json"):
        (folder / name).unlink()
    return folder


def lines_of(path: Path) -> list[tuple[float, str]]:
    """Return (time, name) of each line of a list."""
    rows = (line.split() for line in path.read_text().splitlines() if not line.startswith("#"))
    return [(float(time), name) for time, name in rows]


def write_lines(path: Path, lines: Iterable[str], encoding: str = "utf-8", newline: str = "\n") -> None:
    path.write_bytes((newline.join(lines) + newline).encode(encoding))


def each_line(written: Callable[[float, str], str], lists: tuple[str, ...] = ("depth.txt", "rgb.txt")) -> Change:
    """Return a change that writes each line of the lists anew, from its time and name."""

    def change(folder: Path) -> None:
        for name in lists:
            write_lines(folder / name, [written(time, image) for time, image in lines_of(folder / name)])

    return change

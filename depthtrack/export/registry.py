"""Export of a run's joints to a file of any format.

A new format is a module with a function `write(track, path)` and an entry in EXPORTERS. This module imports no format,
so that the command line lists them at once.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from depthtrack.errors import InputError

if TYPE_CHECKING:
    from depthtrack.export.joint_track import JointTrack

Write = Callable[["JointTrack", Path], None]
"""Write a track to a file; raises InputError if the file cannot be written."""


@dataclass(frozen=True)
class Exporter:
    """A file format.

    suffixes: endings of its files, in lower case.
    load: imports the function that writes them; raises MissingExtraError if its library is not installed.
    """

    suffixes: tuple[str, ...]
    description: str
    load: Callable[[], Write]


def _csv() -> Write:
    from depthtrack.export.csv_table import write

    return write


def _npz() -> Write:
    from depthtrack.export.npz_arrays import write

    return write


def _mot() -> Write:
    from depthtrack.export.mot import write

    return write


def _xr(name: str) -> Write:
    from depthtrack.export.xr_joints import OPENXR, WEBXR, write

    return partial(write, {"openxr": OPENXR, "webxr": WEBXR}[name])


def _mano() -> Write:
    from depthtrack.export.mano import write

    return write


def _bvh() -> Write:
    from depthtrack.export.bvh import write

    return write


def _glb() -> Write:
    from depthtrack.export.glb import write

    return write


def _rrd() -> Write:
    from depthtrack.export.rrd import write

    return write


def _benchmark(name: str) -> Write:
    from depthtrack.export.uvd import write
    from depthtrack.hand.benchmark_joints import find_benchmark

    return partial(write, find_benchmark(name))


EXPORTERS = {
    "csv": Exporter((".csv",), "a table", _csv),
    "npz": Exporter((".npz",), "numpy arrays", _npz),
    "mot": Exporter((".mot",), "joint angles for OpenSim", _mot),
    "openxr": Exporter((".json", ".csv"), "the 26 joints of OpenXR", partial(_xr, "openxr")),
    "webxr": Exporter((".json", ".csv"), "the 25 joints of WebXR", partial(_xr, "webxr")),
    "mano": Exporter((".npz", ".json"), "rotations of MANO's 16 joints", _mano),
    "bvh": Exporter((".bvh",), "a skeleton and its motion", _bvh),
    "glb": Exporter((".glb",), "the moving skin as glTF", _glb),
    "rrd": Exporter((".rrd",), "keypoints for the rerun viewer", _rrd),
    "nyu": Exporter((".txt",), "u v d of NYU's joints", partial(_benchmark, "nyu")),
    "icvl": Exporter((".txt",), "u v d of ICVL's joints", partial(_benchmark, "icvl")),
    "msra": Exporter((".txt",), "u v d of MSRA's joints", partial(_benchmark, "msra")),
}
"""The formats by name."""


def suffixes() -> list[str]:
    """Return the suffixes of all formats, each once."""
    return list(dict.fromkeys(suffix for exporter in EXPORTERS.values() for suffix in exporter.suffixes))


def find_exporter(path: Path, name: str | None = None) -> Exporter:
    """Return the exporter of a format.

    name: by default the format named as the suffix of `path`, or the only one with it.

    Raises:
        InputError: if there is no such format, its files end otherwise, or several formats share the suffix.
    """
    if name is not None and name not in EXPORTERS:
        raise InputError(f"no format '{name}': choose one of {', '.join(EXPORTERS)}")
    suffix = path.suffix.lower()
    fitting = [each for each, exporter in EXPORTERS.items() if suffix in exporter.suffixes]
    if not fitting:
        raise InputError(f"an export must end in {', '.join(suffixes())}, found '{path.name}'")
    if name is None and suffix[1:] in fitting:
        name = suffix[1:]
    if name is None and len(fitting) > 1:
        raise InputError(f"several formats end in {suffix}: choose one by --format {', '.join(fitting)}")
    chosen = fitting[0] if name is None else name
    if chosen not in fitting:
        endings = " or ".join(EXPORTERS[chosen].suffixes)
        raise InputError(f"a file of the format {chosen} must end in {endings}, found '{path.name}'")
    return EXPORTERS[chosen]


def export_joints(path: Path, track: "JointTrack", name: str | None = None) -> None:
    """Write a track to a file of a format, see `find_exporter`.

    Raises:
        InputError: if the format does not fit the path or the file cannot be written.
    """
    find_exporter(path, name).load()(track, path)

"""Run folders from before `run.json` had a format version.

They hold flat options of the trackers pso and ik.
"""

from collections.abc import Mapping
from typing import Any

from depthtrack.errors import InputError
from depthtrack.options import to_data
from depthtrack.tracking.configuration import CONFIGURATIONS

_NAMES = {
    "particles": ("swarm", "particles"),
    "generations": ("swarm", "generations"),
    "renderer": ("scoring", "renderer"),
    "resolution": ("scoring", "resolution"),
    "model": ("fit", "surface"),
    "subsample": ("fit", "subsample"),
    "rounds": ("fit", "icp", "icp_iterations"),
    "inner": ("fit", "icp", "gn_iterations"),
    "residual": ("fit", "icp", "residual"),
    "synergies": ("synergies", "synergies"),
    "components": ("synergies", "components"),
    "soft": ("synergies", "synergy_prior"),
    "seed": ("seed",),
}
"""Place of each flat option among today's; options that kept their default then are absent or null."""
_PAPERS = {"pso": "oikonomidis2011", "ik": "schroeder2014"}
_REPLACED = ("variant", "finish", "skin_model", "synergies_sha256", *_NAMES)


def upgraded(fields: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Return the contents of an earlier `run.json` in today's layout.

    Options that could be set from Python only were not stored; they are assumed to be the defaults.

    Raises:
        InputError: if those versions had no such tracker.
    """
    tracker = fields.get("tracker")
    if tracker not in _PAPERS:
        raise InputError(f"{where}: expected tracker pso or ik in a run without format, found {tracker!r:.40}")
    name = _PAPERS[tracker] if fields.get("variant") == "paper" else tracker
    options = to_data(CONFIGURATIONS[name]())
    for flat, path in _NAMES.items():
        if fields.get(flat) is not None:
            _set(options, path, fields[flat])
    if fields.get("finish") == "skin" and "refine" in options:
        options["refine"] = True
    rest = {key: value for key, value in fields.items() if key not in _REPLACED}
    segmentation = {"skin_model": fields.get("skin_model")}
    return {**rest, "format": 2, "tracker": name, "options": options, "segmentation": segmentation}


def _set(options: dict[str, Any], path: tuple[str, ...], value: Any) -> None:
    """Set a nested option if the tracker has it."""
    *groups, last = path
    for group in groups:
        if not isinstance(options.get(group), dict):
            return
        options = options[group]
    if last in options:
        options[last] = value

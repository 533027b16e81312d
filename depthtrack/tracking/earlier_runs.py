"""Run folders of earlier layouts of `run.json`.

Those without a format version hold flat options of the trackers pso and ik. Those of format 2 count the memory of a
track in frames. Before format 4, trackers followed no branches; before format 5, a lost hand was not located anew.
Before format 6, an arm that points at the camera was no special case, and fits held each angle alone.
"""

import dataclasses
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
_RATE = 30.0
"""Frames per second of the recordings that the memory of format 2 was meant for."""
_PAPERS = {"pso": "oikonomidis2011", "ik": "schroeder2014"}
_REPLACED = ("variant", "finish", "skin_model", "synergies_sha256", *_NAMES)


def upgraded(fields: Mapping[str, Any], where: str) -> Mapping[str, Any]:
    """Return the contents of a `run.json` in today's layout.

    Raises:
        InputError: if those versions had no such tracker.
    """
    if "format" not in fields:
        fields = _nested(fields, where)
    if fields["format"] == 2:
        fields = _with_seconds(fields)
    if fields["format"] == 3:
        fields = _without_branches(fields)
    if fields["format"] == 4:
        fields = _without_relocation(fields)
    return _without_posture_prior(fields) if fields["format"] == 5 else fields


def _without_posture_prior(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the contents of format 5 whose fits hold each angle alone.

    Its segmentation finds the wrist of every arm alike.
    """
    options, name, segmentation = fields.get("options"), fields.get("tracker"), fields.get("segmentation") or {}
    if isinstance(options, dict) and isinstance(name, str) and name in CONFIGURATIONS:
        options = _unweighted(options, to_data(CONFIGURATIONS[name]()))
    if isinstance(segmentation, dict):
        segmentation = {**segmentation, "foreshortened_wrist": {"least_cosine": 1.0}}
    return {**fields, "format": 6, "options": options, "segmentation": segmentation}


def _unweighted(options: Mapping[str, Any], defaults: Mapping[str, Any]) -> dict[str, Any]:
    """Return options whose fits have no prior on the posture.

    defaults: all options of the tracker; those of its fits have a `posture_weight`.
    """
    changed = dict(options)
    for name, value in defaults.items():
        if name == "posture_weight":
            changed[name] = 0.0
        elif isinstance(value, dict) and isinstance(options.get(name, {}), dict):
            group = _unweighted(options.get(name, {}), value)
            if group:
                changed[name] = group
    return changed


def _without_relocation(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the contents of format 4 whose segmentation follows a lost hand."""
    segmentation = fields.get("segmentation") or {}
    if not isinstance(segmentation, dict):
        return {**fields, "format": 5}
    search = segmentation.get("search") or {}
    search = {**search, "lost_lifetime": 0.0} if isinstance(search, dict) else search
    return {**fields, "format": 5, "segmentation": {**segmentation, "search": search}}


def _without_branches(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the contents of format 3 without searches for branches."""
    options, name = fields.get("options"), fields.get("tracker")
    if isinstance(options, dict) and isinstance(name, str) and "branches" in _option_names(name):
        options = {**options, "branches": {"interval": 0.0}}
    return {**fields, "format": 4, "options": options}


def _option_names(tracker: str) -> set[str]:
    """Return the names of the options of a tracker; none if there is no such tracker."""
    return {each.name for each in dataclasses.fields(CONFIGURATIONS[tracker])} if tracker in CONFIGURATIONS else set()


def _with_seconds(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the contents of format 2 with the memory of a track in seconds."""
    options = fields.get("options")
    thresholds = options.get("thresholds") if isinstance(options, dict) else None
    if not isinstance(options, dict) or not isinstance(thresholds, dict):
        return {**fields, "format": 3}
    rest = {name: value for name, value in thresholds.items() if name != "memory_frames"}
    frames = thresholds.get("memory_frames")
    memory = {"memory": frames / _RATE} if isinstance(frames, int) else {}
    # Those versions followed the last pose after any pause.
    options = {**options, "thresholds": _renamed(rest) | memory | {"longest_gap": "inf", "confidence": 0.0}}
    if isinstance(recovery := options.get("recovery"), dict):
        options["recovery"] = _renamed(recovery)
    return {**fields, "format": 3, "options": options}


def _renamed(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return options with the agreement of silhouettes by its name; it was called confidence."""
    return {name.replace("confidence", "agreement"): value for name, value in options.items()}


def _nested(fields: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Return flat options in today's layout.

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
    if "refine" in options:
        options["refine"] = fields.get("finish") == "skin"
    if fields.get("finish") == "skin":
        _set(options, ("surface_choice", "surfaces"), ["skin"])
    rest = {key: value for key, value in fields.items() if key not in _REPLACED}
    segmentation = {"skin_model": fields.get("skin_model")}
    return {**rest, "format": 3, "tracker": name, "options": options, "segmentation": segmentation}


def _set(options: dict[str, Any], path: tuple[str, ...], value: Any) -> None:
    """Set a nested option if the tracker has it."""
    *groups, last = path
    for group in groups:
        if not isinstance(options.get(group), dict):
            return
        options = options[group]
    if last in options:
        options[last] = value

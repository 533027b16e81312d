"""The configuration of a run: everything that decides its poses, as `run.json` stores it."""

import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal, Self

import cv2
import numba
import numpy as np
import scipy

import depthtrack
from depthtrack.errors import InputError
from depthtrack.files import read_bounded
from depthtrack.geometry.camera import Camera
from depthtrack.hand.shape import HandShape
from depthtrack.hand.synergies import load_synergies
from depthtrack.options import from_data, to_data
from depthtrack.recording.keypoints import MAX_BYTES
from depthtrack.recording.reading import ReadingOptions
from depthtrack.recording.run_folder import Run, read_configuration
from depthtrack.recording.sequence import OnDamage
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.segmentation.skin_colour import MAX_BYTES as MAX_SKIN_BYTES
from depthtrack.solver.options import SurfaceName
from depthtrack.tracking.backward_options import BackwardOptions
from depthtrack.tracking.configuration import (
    RUN_CONFIGURATIONS,
    HybridConfig,
    MarkersConfig,
    Oikonomidis2011Config,
    PsoConfig,
    RunConfig,
)
from depthtrack.tracking.earlier_runs import upgraded

FORMAT = 6
"""Version of the layout of `run.json`; runs without it were written before the options were nested."""

LONGEST_PATH = 1024
"""Characters."""

Start = Literal["auto", "truth"]


@dataclass(frozen=True)
class RunConfiguration:
    """Recording, hand, tracker with its options, and settings of a run.

    sequence: path of the recording, absolute or from the run folder.
    camera, hand: contents of `camera.json` and `hand.json`.
    keypoints: path of a file of keypoints, see `recording.keypoints`; None for none.
    backward: how doubtful stretches are tracked backwards; None for not at all.
    frames: number of frames to track; None for all.
    context: entries that do not change poses or only describe the run: label, seed of a comparison, machine, ...
    """

    sequence: str
    camera: Mapping[str, Any]
    hand: Mapping[str, Any]
    tracker: RunConfig
    segmentation: SegmentationOptions = field(default_factory=SegmentationOptions)
    start: Start = "auto"
    frames: int | None = None
    on_damage: OnDamage = "refuse"
    keypoints: str | None = None
    backward: BackwardOptions | None = None
    reading: ReadingOptions = field(default_factory=ReadingOptions)
    context: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check the choices. Raises InputError if one is out of range."""
        _check_choices(
            {"start": self.start, "frames": self.frames, "on_damage": self.on_damage, "keypoints": self.keypoints},
            "the run",
        )

    @property
    def surfaces(self) -> tuple[SurfaceName, ...]:
        """Surfaces that the tracker minimises the distance to, the preferred one first.

        A swarm that is not refined minimises the distance to the rendered primitives.
        """
        options = self.tracker
        if isinstance(options, HybridConfig):
            return options.surface_choice.surfaces
        if isinstance(options, MarkersConfig):
            return (options.surface,)
        if isinstance(options, PsoConfig):
            return options.surface_choice.surfaces if options.refine else ("primitives",)
        return ("primitives",) if isinstance(options, Oikonomidis2011Config) else (options.fit.surface,)

    def to_fields(self) -> dict[str, Any]:
        """Return the contents of `run.json`.

        A file that the configuration names may change, so its digest is stored with it.
        """
        return {
            "format": FORMAT,
            "sequence": self.sequence,
            "tracker": self.tracker.name,
            "options": to_data(self.tracker),
            "segmentation": to_data(self.segmentation),
            "start": self.start,
            "frames": self.frames,
            "on_damage": self.on_damage,
            "keypoints": self.keypoints,
            **({} if self.backward is None else {"backward": to_data(self.backward)}),
            **({} if self.reading == ReadingOptions() else {"reading": to_data(self.reading)}),
            "camera": dict(self.camera),
            "hand": dict(self.hand),
            "digests": digests(self),
            **self.context,
        }

    @classmethod
    def from_fields(cls, fields: Mapping[str, Any], where: str) -> Self:
        """Return the configuration of the contents of a `run.json`, earlier layouts included.

        Raises:
            InputError: if an entry is missing or malformed; the message names `where`.
        """
        fields = upgraded(fields, where)
        if fields["format"] != FORMAT:
            raise InputError(f"{where}: expected format {FORMAT}, found {fields['format']!r:.40}: update depthtrack")
        name = fields.get("tracker")
        if name not in RUN_CONFIGURATIONS:
            raise InputError(f"{where}: no tracker {name!r:.60}: expected one of {', '.join(RUN_CONFIGURATIONS)}")
        for entry, kind in (("sequence", str), ("camera", dict), ("hand", dict)):
            if not isinstance(fields.get(entry), kind):
                raise InputError(f"{where}: expected an entry '{entry}', found {fields.get(entry)!r:.40}")
        own = ("format", "tracker", "options", "digests", "segmentation", "reading", "backward")
        rest = {name: value for name, value in fields.items() if name not in own}
        known = {entry: rest.pop(entry) for entry in ("sequence", "camera", "hand")}
        known |= {entry: rest.pop(entry) for entry in ("start", "frames", "on_damage", "keypoints") if entry in rest}
        _check_choices(known, where)
        skin_model = dict(fields.get("segmentation") or {}).get("skin_model")
        paths = {"sequence": known["sequence"], "keypoints": known.get("keypoints"), "skin_model": skin_model}
        for entry, path in paths.items():
            if isinstance(path, str) and (len(path) > LONGEST_PATH or "\0" in path):
                raise InputError(f"{where}: expected a path as {entry}, found {path[:80]!r}")
        return cls(
            **known,
            tracker=from_data(RUN_CONFIGURATIONS[name], fields.get("options", {}), f"{where}: options"),
            segmentation=from_data(SegmentationOptions, fields.get("segmentation", {}), f"{where}: segmentation"),
            backward=(
                None
                if fields.get("backward") is None
                else from_data(BackwardOptions, fields["backward"], f"{where}: backward")
            ),
            reading=from_data(ReadingOptions, fields.get("reading", {}), f"{where}: reading"),
            context=rest,
        )

    @classmethod
    def of(cls, run: Run) -> Self:
        """Return the configuration of a run. Raises InputError if its `run.json` is malformed."""
        return cls.from_fields(run.configuration, str(run.folder / "run.json"))

    @classmethod
    def load(cls, path: Path) -> Self:
        """Return the configuration in a run folder or its `run.json`. Raises InputError."""
        folder = path.parent if path.name == "run.json" else path
        fields = read_configuration(folder)
        configuration = cls.from_fields(fields, str(folder / "run.json"))
        _check_digests(configuration, fields.get("digests", {}), folder)
        return configuration

    def hand_shape(self, where: str = "run.json") -> HandShape:
        """Return the hand. Raises InputError if the entry is malformed."""
        try:
            return HandShape.from_fields(dict(self.hand))
        except (KeyError, TypeError, ValueError, AttributeError, InputError) as error:
            raise InputError(f"{where} names no usable hand: {error}") from error

    def camera_model(self, where: str = "run.json") -> Camera:
        """Return the camera. Raises InputError if the entry is malformed."""
        try:
            return Camera.from_fields(dict(self.camera))
        except InputError as error:
            raise InputError(f"{where}: camera: {error}") from error

    def with_context(self, **entries: Any) -> Self:
        """Return the configuration with further descriptive entries."""
        return replace(self, context={**self.context, **entries})


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that decide poses."""
    modules = (depthtrack, np, numba, cv2, scipy)
    return {"python": platform.python_version(), **{module.__name__: module.__version__ for module in modules}}


def digests(configuration: RunConfiguration) -> dict[str, str]:
    """Return SHA-256 of the files that a configuration names.

    Raises:
        InputError: if the file of keypoints is missing or too long.
    """
    found = {}
    synergies = getattr(configuration.tracker, "synergies", None)
    if synergies is not None and synergies.synergies is not None:
        found["synergies"] = sha256(load_synergies(synergies.synergies).to_json().encode()).hexdigest()
    if configuration.segmentation.skin_model is not None:
        found["skin_model"] = sha256(
            read_bounded(Path(configuration.segmentation.skin_model), MAX_SKIN_BYTES)
        ).hexdigest()
    if configuration.keypoints is not None:
        found["keypoints"] = sha256(read_bounded(Path(configuration.keypoints), MAX_BYTES)).hexdigest()
    return found


def _check_digests(configuration: RunConfiguration, stored: Mapping[str, str], folder: Path) -> None:
    for name, digest in digests(configuration).items():
        if stored.get(name, digest) != digest:
            raise InputError(
                f"the file of {name} that {folder / 'run.json'} names has changed since: "
                "restore it, or name another one"
            )


def _check_choices(entries: Mapping[str, Any], where: str) -> None:
    frames, keypoints = entries.get("frames"), entries.get("keypoints")
    if entries.get("start", "auto") not in ("auto", "truth"):
        raise InputError(f"{where}: start must be auto or truth, found {entries['start']!r:.40}")
    if entries.get("on_damage", "refuse") not in ("refuse", "skip"):
        raise InputError(f"{where}: on_damage must be refuse or skip, found {entries['on_damage']!r:.40}")
    if keypoints is not None and not isinstance(keypoints, str):
        raise InputError(f"{where}: keypoints must be the path of a file, found {keypoints!r:.40}")
    if frames is not None and not (isinstance(frames, int) and frames >= 1):
        raise InputError(f"{where}: frames must be a whole number from 1, found {frames!r:.40}")


def camera_fields(camera: Camera) -> dict[str, Any]:
    """Return the contents of a `camera.json`."""
    return asdict(camera)

"""Contents of `markers.json`: source, models and configuration of a marker folder."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any, Self

from depthtrack.errors import InputError
from depthtrack.files import compact_json, open_regular, read_json

FORMAT = 1
CONTENTS_FILE = "markers.json"
MODELS = "models"
SUFFIXES = (".csv", ".c3d", ".trc")
"""Of the labelled trajectories."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
_RESERVED = {MODELS, "labelled", "confidence", "residual", "filled", "markers"}
_CHUNK = 1 << 20


@dataclass(frozen=True)
class Source:
    """The file that a marker folder was made from, and its SHA-256."""

    path: str
    sha256: str

    @classmethod
    def of(cls, path: Path) -> Self:
        """Return the source at a path. Raises InputError if it cannot be read."""
        return cls(str(path.resolve()), _digest(path))

    def check(self) -> None:
        """Raise InputError if the file is still there, but has changed since."""
        if Path(self.path).exists() and _digest(Path(self.path)) != self.sha256:
            raise InputError(f"{self.path} has changed since its markers were labelled: restore it, or label it again")


@dataclass(frozen=True)
class Contents:
    """Contents of `markers.json`.

    labelled: name of the file of trajectories.
    rate: frames a second, Hz.
    first_frame: number of the first frame in the source.
    models: name of each model.
    source: None for a capture that comes from no file.
    configuration: options of the commands, as JSON values.
    filled: whether gaps were filled.
    notes: what reading the source changed or assumed, a sentence each.
    versions: of the packages that decide poses.

    Raises:
        InputError: if a name is unusable.
    """

    labelled: str
    rate: float
    first_frame: int
    models: tuple[str, ...]
    source: Source | None = None
    configuration: Mapping[str, Any] = field(default_factory=dict)
    filled: bool = False
    notes: tuple[str, ...] = ()
    versions: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_names(self.models)
        if self.labelled not in {f"labelled{suffix}" for suffix in SUFFIXES}:
            raise InputError(f"labelled must be labelled{' or '.join(SUFFIXES)}, found {self.labelled[:40]!r}")
        if not 0 < self.rate <= 1e5:  # false for NaN
            raise InputError(f"the rate must be above 0 and at most 100,000 Hz, found {self.rate:g}")

    def to_json(self) -> str:
        """Return the text of the file."""
        return compact_json(
            {
                "format": FORMAT,
                "source": None if self.source is None else {"path": self.source.path, "sha256": self.source.sha256},
                "labelled": self.labelled,
                "rate": self.rate,
                "first_frame": self.first_frame,
                "models": list(self.models),
                "filled": self.filled,
                "configuration": dict(self.configuration),
                "notes": list(self.notes),
                "versions": dict(self.versions),
            }
        )

    @classmethod
    def load(cls, folder: Path) -> Self:
        """Return the contents in a marker folder.

        Raises:
            InputError: if it holds none, or malformed ones.
        """
        return read_json(folder / CONTENTS_FILE, "the marker folder", cls.from_fields, made_by="depthtrack markers")

    @classmethod
    def from_fields(cls, fields: dict[str, Any]) -> Self:
        """Return the parsed contents.

        Raises:
            KeyError, TypeError, ValueError: if an entry is missing or malformed.
            InputError: if the format is a later one, or a name is unusable.
        """
        if fields["format"] != FORMAT:
            raise InputError(f"expected format {FORMAT}, found {fields['format']!r:.40}: update depthtrack")
        source = fields["source"]
        return cls(
            labelled=str(fields["labelled"]),
            rate=float(fields["rate"]),
            first_frame=int(fields["first_frame"]),
            models=tuple(map(str, fields["models"])),
            source=None if source is None else Source(str(source["path"]), str(source["sha256"])),
            configuration=dict(fields.get("configuration", {})),
            filled=bool(fields.get("filled", False)),
            notes=tuple(map(str, fields.get("notes", ()))),
            versions=dict(fields.get("versions", {})),
        )


def is_marker_folder(path: Path) -> bool:
    """Return whether a marker command wrote this folder."""
    return (path / CONTENTS_FILE).is_file()


def run_folder(path: Path) -> Path:
    """Return the run folder at a path: in a marker folder, that of its only hand.

    Raises:
        InputError: if a marker folder has no hand, or several.
    """
    if not is_marker_folder(path):
        return path
    hands = [name for name in Contents.load(path).models if (path / name / "run.json").exists()]
    if len(hands) != 1:
        found = ", ".join(str(path / name) for name in hands) or "none"
        raise InputError(f"{path} must have one hand to be a run: name the run folder of a hand, found {found}")
    return path / hands[0]


def check_names(names: Sequence[str]) -> None:
    """Raise InputError unless the names of the models can name files, each its own."""
    for name in names:
        if not _NAME.fullmatch(name) or name.lower() in _RESERVED:
            raise InputError(f"a model's name must be up to 64 letters, digits, '.', '_' and '-', found {name[:80]!r}")
    # Some file systems ignore case.
    if not names or len({name.lower() for name in names}) != len(names):
        raise InputError(f"a marker folder must have models of different names, found {', '.join(names)[:120]!r}")


def _digest(path: Path) -> str:
    found = sha256()
    try:
        with open_regular(path) as file:
            while chunk := file.read(_CHUNK):
                found.update(chunk)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    return found.hexdigest()

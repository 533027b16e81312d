"""What a run folder tells of how it was made: enough to make it again."""

import json
import platform
from dataclasses import asdict
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

from depthtrack.hand.shape import HandShape
from depthtrack.hand.synergies import load_synergies
from depthtrack.recording.sequence import Sequence


def run_configuration(
    path: Path,
    sequence: Sequence,
    hand: HandShape,
    tracker: str,
    options: dict[str, Any],
    *,
    start: str = "auto",
    frames: int | None = None,
    skin_model: Path | None = None,
    on_damage: str = "refuse",
    threads: int | None = None,
    **more: Any,
) -> dict[str, Any]:
    """The contents of run.json: recording at `path`, tracker and options, camera, hand, versions; and `more`.

    Threads change no pose, so they are told apart from the options; a file of synergies may change, so its contents
    are told by their digest.
    """
    synergies = options.get("synergies")
    if synergies is not None:
        more["synergies_sha256"] = sha256(load_synergies(synergies).to_json().encode()).hexdigest()
    return {
        "sequence": str(path.resolve()),
        "tracker": tracker,
        "start": start,
        "frames": frames,
        **{name: value for name, value in options.items() if name != "threads"},
        **more,
        "skin_model": None if skin_model is None else str(skin_model.resolve()),
        "on_damage": on_damage,
        "threads": threads,
        "camera": asdict(sequence.camera),
        "hand": json.loads(hand.to_json()),
        "versions": {
            "python": platform.python_version(),
            **{name: version(name) for name in ("depthtrack", "numpy", "numba")},
        },
    }

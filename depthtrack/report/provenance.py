"""What a reader must know to trust or repeat the figures: recordings, hands, cameras, options, machines."""

from collections.abc import Mapping, Sequence
from typing import Any

from depthtrack.evaluation.compare.results import Line
from depthtrack.recording.sequence import Sequence as Recording
from depthtrack.report.narrative import listed

Fact = tuple[str, str]

_NOT_OPTIONS = (
    *("sequence", "tracker", "start", "frames", "skin_model", "on_damage", "threads", "camera", "hand", "versions"),
    *("label", "clock", "budget", "seed", "machine"),
)
_MOST_CHARACTERS = 160


def facts_of_recording(recording: Recording, line: Line) -> list[Fact]:
    """Length, camera, hand, and how the recording was made, as far as it says."""
    configuration = line.evaluations[0].run.configuration
    camera, hand = recording.camera, configuration.get("hand", {})
    times = recording.timestamps
    seconds = float(times[-1] - times[0]) if len(times) > 1 else 0.0
    truth = recording.ground_truth
    known = "none" if truth is None else "poses" if truth.poses is not None else "annotated joints"
    frames = f"{line.evaluations[0].frames} of {len(recording)}, {seconds:.1f} s in all"
    made = ", ".join(f"{name} {_plain(value)}" for name, value in recording.description.items() if _says(value))
    return [
        ("frames", frames),
        ("ground truth", known),
        ("camera", f"{camera.width} × {camera.height}, fx {camera.fx:.1f}, fy {camera.fy:.1f}"),
        ("hand", ", ".join(f"{name} {_plain(hand[name])}" for name in ("side", "scale", "source") if name in hand)),
        *([("made by", made)] if made else []),
    ]


def facts_of_tracker(label: str, lines: Sequence[Line]) -> list[Fact]:
    """Tracker, options, seeds, versions and machine; values that differ between runs are told side by side."""
    runs = [evaluation.run.configuration for line in lines if line.label == label for evaluation in line.evaluations]
    told = (name for run in runs for name, value in run.items() if name not in _NOT_OPTIONS and value is not None)
    options = list(dict.fromkeys(told))
    budgets = [run["budget"] for run in runs if isinstance(run.get("budget"), dict)]
    facts = [
        ("tracker", _together([run.get("tracker") for run in runs])),
        ("options", ", ".join(f"{name} {_together([run.get(name) for run in runs])}" for name in options)),
        ("seeds", _together([run.get("seed") for run in runs])),
        ("threads", _together([run.get("threads") for run in runs])),
        ("versions", _together([_pairs(run.get("versions")) for run in runs])),
        ("machine", _together([_pairs(run.get("machine")) for run in runs if run.get("machine")])),
    ]
    if budgets:
        times = [budget.get("calibrated_ms") for budget in budgets]
        found = _together([f"{ms} ms" if ms is not None else "no hand found, so not" for ms in times])
        facts.insert(
            2, ("equal time", f"{_together([b.get('equal_ms') for b in budgets])} ms asked, {found} calibrated")
        )
    return [(name, text) for name, text in facts if text]


def bias_warning(description: Mapping[str, Any], lines: Sequence[Line]) -> str:
    """Return a warning if a synthetic hand was drawn from the model that some trackers fit, and others do not."""
    favoured = matched_model(description, lines)
    others = [label for label in dict.fromkeys(line.label for line in lines) if label not in favoured]
    if not favoured:
        return ""
    names = {"skin": "the skin", "primitives": "the spheres and cylinders"}
    hand = names.get(_drawn_surface(description), "the rigged mesh")
    fit, do = ("fits" if len(favoured) == 1 else "fit"), ("does" if len(others) == 1 else "do")
    first, rest = listed(favoured), listed(others)
    return f"Home ground: the hand was drawn from {hand} that {first} {fit}, and {rest} {do} not."


def matched_model(description: Mapping[str, Any], lines: Sequence[Line]) -> tuple[str, ...]:
    """Return the trackers that fit the model that a synthetic hand was drawn from, if others fit another; else none."""
    drawn = _drawn_surface(description)
    if not drawn:
        return ()
    labels = dict.fromkeys(line.label for line in lines)
    favoured = tuple(label for label in labels if all(_surface(line) == drawn for line in lines if line.label == label))
    return favoured if len(favoured) < len(labels) else ()


def _drawn_surface(description: Mapping[str, Any]) -> str:
    """Return "skin", "primitives" or the digest of the rig that a synthetic hand was drawn from; else ""."""
    model = description.get("model")
    if model == "rig":
        return str(description.get("sha256", ""))
    return str(model) if model in ("skin", "primitives") else ""


def _surface(line: Line) -> str:
    """Return the surface that the line's tracker fits: see `_drawn_surface`."""
    configuration = line.evaluations[0].run.configuration
    finished = configuration.get("finish") == "skin"
    of_pso = ("skin" if finished else "primitives") if configuration.get("tracker") == "pso" else ""
    model = str(configuration.get("model", of_pso))
    hand = configuration.get("hand")
    rig = hand.get("rig") if isinstance(hand, dict) else None
    return str(rig.get("sha256")) if isinstance(rig, dict) and model == "skin" else model


def _together(values: Sequence[Any]) -> str:
    texts = list(dict.fromkeys(_plain(value) for value in values if value is not None))
    shown = " / ".join(texts[:6]) + (" / ..." if len(texts) > 6 else "")
    return shown[:_MOST_CHARACTERS]


def _pairs(value: Any) -> str | None:
    return ", ".join(f"{name} {part}" for name, part in value.items()) if isinstance(value, dict) else None


def _says(value: Any) -> bool:
    return isinstance(value, str | int | float) and value not in ("", None)


def _plain(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return text if len(text) <= _MOST_CHARACTERS else f"{text[:_MOST_CHARACTERS]}..."

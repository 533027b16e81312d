"""What a reader must know to trust or repeat the figures: recordings, hands, cameras, options, machines."""

from collections.abc import Mapping, Sequence
from typing import Any

from depthtrack.evaluation.compare.results import TrackerResult
from depthtrack.evaluation.compare.specs import label_of as tracker_label
from depthtrack.recording.sequence import Sequence as Recording
from depthtrack.report.narrative import listed

Fact = tuple[str, str]

_MOST_CHARACTERS = 160


def facts_of_recording(recording: Recording, line: TrackerResult) -> list[Fact]:
    """Length, camera, hand, and how the recording was made, as far as it says."""
    camera, hand = recording.camera, line.evaluations[0].configuration.hand
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


def facts_of_tracker(label: str, lines: Sequence[TrackerResult]) -> list[Fact]:
    """Tracker, options, seeds, versions and machine; values that differ between runs are told side by side."""
    runs = [evaluation.configuration for line in lines if line.label == label for evaluation in line.evaluations]
    contexts = [run.context for run in runs]
    budgets = [context["budget"] for context in contexts if isinstance(context.get("budget"), dict)]
    facts = [
        ("tracker", _together([run.tracker.name for run in runs])),
        ("options", _together([tracker_label(run.tracker) for run in runs])),
        ("seeds", _together([run.tracker.seed for run in runs])),
        ("threads", _together([context.get("threads") for context in contexts])),
        ("versions", _together([_pairs(context.get("versions")) for context in contexts])),
        ("machine", _together([_pairs(context.get("machine")) for context in contexts if context.get("machine")])),
    ]
    if budgets:
        times = [budget.get("calibrated_ms") for budget in budgets]
        found = _together([f"{ms} ms" if ms is not None else "no hand found, so not" for ms in times])
        facts.insert(
            2, ("equal time", f"{_together([b.get('equal_ms') for b in budgets])} ms asked, {found} calibrated")
        )
    return [(name, text) for name, text in facts if text]


def bias_warning(description: Mapping[str, Any], lines: Sequence[TrackerResult]) -> str:
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


def matched_model(description: Mapping[str, Any], lines: Sequence[TrackerResult]) -> tuple[str, ...]:
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


def _surface(line: TrackerResult) -> str:
    """Return the surface that the line's tracker fits: see `_drawn_surface`."""
    configuration = line.evaluations[0].configuration
    rig = configuration.hand.get("rig")
    if configuration.surface == "cylinders":
        return "primitives"
    return str(rig.get("sha256")) if isinstance(rig, dict) else "skin"


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

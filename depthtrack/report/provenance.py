"""Provenance of the results: recordings, hands, cameras, options, versions and machines."""

from collections.abc import Mapping, Sequence
from typing import Any

from depthtrack.evaluation.compare.results import TrackerResult
from depthtrack.evaluation.compare.specs import label_of as tracker_label
from depthtrack.recording.sequence import Sequence as Recording
from depthtrack.report.narrative import enumeration

Fact = tuple[str, str]
"""Name and value."""

_MOST_CHARACTERS = 160


def recording_facts(recording: Recording, result: TrackerResult) -> list[Fact]:
    """Return the recording's length, ground truth, camera, hand and synthesis options."""
    camera, hand = recording.camera, result.evaluations[0].configuration.hand
    times = recording.timestamps
    seconds = float(times[-1] - times[0]) if len(times) > 1 else 0.0
    truth = recording.ground_truth
    known = "none" if truth is None else "poses" if truth.poses is not None else "annotated joints"
    frames = f"{result.evaluations[0].frames} of {len(recording)}, which last {seconds:.1f} s"
    made = ", ".join(f"{name} {_plain(value)}" for name, value in recording.description.items() if _is_plain(value))
    return [
        ("frames", frames),
        ("ground truth", known),
        ("camera", f"{camera.width} × {camera.height}, fx {camera.fx:.1f}, fy {camera.fy:.1f}"),
        ("hand", ", ".join(f"{name} {_plain(hand[name])}" for name in ("side", "scale", "source") if name in hand)),
        *([("description", made)] if made else []),
    ]


def tracker_facts(label: str, results: Sequence[TrackerResult]) -> list[Fact]:
    """Return tracker, options, seeds, versions and machine, with all values of the runs."""
    runs = [
        evaluation.configuration for result in results if result.label == label for evaluation in result.evaluations
    ]
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
        measured = _together([f"{ms} ms" if ms is not None else "not measured (no hand found)" for ms in times])
        budget = _together([b.get("equal_ms") for b in budgets])
        facts.insert(2, ("equal time", f"budget {budget} ms, calibration {measured}"))
    return [(name, text) for name, text in facts if text]


def bias_warning(description: Mapping[str, Any], results: Sequence[TrackerResult]) -> str:
    """Return a warning if the hand was rendered from the model that only some trackers fit."""
    favoured = matched_model(description, results)
    others = [label for label in dict.fromkeys(result.label for result in results) if label not in favoured]
    if not favoured:
        return ""
    names = {"skin": "the skin model", "primitives": "the model of spheres and cylinders"}
    hand = names.get(_rendered_model(description), "the rigged mesh")
    fit, do = ("fits" if len(favoured) == 1 else "fit"), ("does" if len(others) == 1 else "do")
    return (
        f"Biased comparison: the hand was rendered from {hand} that {enumeration(favoured)} {fit} "
        f"and {enumeration(others)} {do} not."
    )


def matched_model(description: Mapping[str, Any], results: Sequence[TrackerResult]) -> tuple[str, ...]:
    """Return the trackers that fit the model of the rendered hand; empty if all do."""
    rendered = _rendered_model(description)
    if not rendered:
        return ()
    fits = {result.label: rendered in _fitted_models(result) for result in results}
    favoured = tuple(label for label in fits if fits[label])
    return favoured if len(favoured) < len(fits) else ()


def _rendered_model(description: Mapping[str, Any]) -> str:
    """Return the model of a synthetic hand: "skin", "primitives" or a rig's digest; else ""."""
    model = description.get("model")
    if model == "rig":
        return str(description.get("sha256", ""))
    return str(model) if model in ("skin", "primitives") else ""


def _fitted_models(result: TrackerResult) -> set[str]:
    """Return the models that the result's tracker fits; see `_rendered_model`."""
    configuration = result.evaluations[0].configuration
    rig = configuration.hand.get("rig")
    skin = str(rig.get("sha256")) if isinstance(rig, dict) else "skin"
    return {skin if surface == "skin" else surface for surface in configuration.surfaces}


def _together(values: Sequence[Any]) -> str:
    texts = list(dict.fromkeys(_plain(value) for value in values if value is not None))
    shown = " / ".join(texts[:6]) + (" / ..." if len(texts) > 6 else "")
    return shown[:_MOST_CHARACTERS]


def _pairs(value: Any) -> str | None:
    return ", ".join(f"{name} {part}" for name, part in value.items()) if isinstance(value, dict) else None


def _is_plain(value: Any) -> bool:
    return isinstance(value, str | int | float) and value not in ("", None)


def _plain(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return text if len(text) <= _MOST_CHARACTERS else f"{text[:_MOST_CHARACTERS]}..."

"""The page in words: what came out, in a sentence or two that the figures bear out."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from depthtrack.evaluation.compare.results import TRACKER_MS, TrackerResult

ALIKE = 1.05
"""Figures that differ by less than this factor are called the same."""
_MOST_NAMED = 3
_SPACE = "\u00a0"
"""Between a number and its unit, where no line may break."""

ERRORS = {"endpoint_error_mm": "mean endpoint error", "joint_error_mm": "mean joint error", "e3d_mm": "median E3D"}


@dataclass(frozen=True)
class Verdict:
    """A headline, and the sentences below it."""

    headline: str
    sentences: tuple[str, ...]


@dataclass(frozen=True)
class Standing:
    """A tracker over all recordings: the mean of its errors (mm) on them, the mean of its median milliseconds a frame
    without segmentation, and how many of its frames were lost."""

    label: str
    error: float
    ms: float | None
    lost: int
    frames: int


def judged_by(lines: Sequence[TrackerResult]) -> str:
    """The metric that trackers are judged by: the truth's, where any recording has one, else the distance E3D."""
    return next((line.truth for line in lines if line.truth is not None), "e3d_mm")


def error_name(lines: Sequence[TrackerResult]) -> str:
    """What the errors are called that trackers are judged by."""
    truths = {line.truth for line in lines if line.truth is not None}
    return "mean error" if len(truths) > 1 else ERRORS[judged_by(lines)]


def where(lines: Sequence[TrackerResult]) -> str:
    """On which recordings trackers are judged, where that is not all there is to say."""
    every, judged = {line.source for line in lines}, _winners(lines)
    if not _all_judged(lines):
        return f" on the {_count(len(judged))} of {_count(len(every))} recordings with a known truth"
    return " over all recordings" if len(every) > 1 else ""


def standings(lines: Sequence[TrackerResult]) -> list[Standing]:
    """All trackers, the closest first; with an infinite error those that found no hand where others are judged."""
    judged = set(_winners(lines))
    found = []
    for label in dict.fromkeys(line.label for line in lines):
        own = [line for line in lines if line.label == label]
        errors = {line.source: error for line in own if (error := _error(line, lines)) is not None}
        times = [ms for line in own if (ms := line.figure(TRACKER_MS, "median")) is not None]
        found.append(
            Standing(
                label,
                float(np.mean(list(errors.values()))) if errors and judged <= set(errors) else float("inf"),
                float(np.mean(times)) if times else None,
                sum(line.lost for line in own),
                sum(line.frames for line in own),
            )
        )
    return sorted(found, key=lambda standing: standing.error)


def verdict(
    lines: Sequence[TrackerResult], equal_ms: float | None = None, matched_model: Sequence[str] = ()
) -> Verdict:
    """What the comparison says; `equal_ms` where all trackers were given the same time a frame, `matched_model` the
    trackers whose very model every recording's hand was drawn from."""
    found = standings(lines)
    first = found[0]
    if not np.isfinite(first.error):
        return Verdict("No tracker followed the hand", (_losses(found),))
    if len(found) == 1:
        speed = "" if first.ms is None else f", at {first.ms:.1f}{_SPACE}ms a frame"
        told = f"That is its {error_name(lines)}{speed}."
        return Verdict(f"{first.label} follows the hand to {_mm(first.error)}", (told, _losses(found)))
    winners = _winners(lines)
    headline, told = _split(lines, winners) if len(set(winners.values())) > 1 else _clear(lines, found)
    headline = _matched_model(headline, first.label, matched_model) if matched_model else headline
    sentences = (told, _elsewhere(lines), _speeds(found, equal_ms), _losses(found))
    return Verdict(headline, tuple(filter(None, sentences)))


def _matched_model(headline: str, first: str, matched_model: Sequence[str]) -> str:
    """The headline of a comparison on the home ground of some trackers; `first` is the closest."""
    if not headline.startswith(f"{first} follows"):
        return f"{headline}, on the home ground of {listed(matched_model)}"
    ground = "its home ground" if list(matched_model) == [first] else f"the home ground of {listed(matched_model)}"
    return f"On {ground}, {headline}"


def _clear(lines: Sequence[TrackerResult], found: Sequence[Standing]) -> tuple[str, str]:
    """One tracker is closest on every recording, or several are alike."""
    first, *others = [standing for standing in found if np.isfinite(standing.error)]
    against = [f"{standing.label}'s {_mm(standing.error)}" for standing in others]
    told = f"{first.label}'s {error_name(lines)} is {_mm(first.error)}{where(lines)}"
    told += f", {listed(against)}." if against else "."
    alike = [standing.label for standing in found if standing.error < ALIKE * first.error]
    if len(alike) > 1:
        headline = f"{listed(alike)} follow the hand equally closely"
    elif len(found) == 2:
        headline = f"{first.label} follows the hand more closely than {found[1].label}"
    else:
        headline = f"{first.label} follows the hand most closely of {_count(len(found))} trackers"
    # Elsewhere, it may be otherwise.
    headline = headline if _all_judged(lines) else f"Where the truth is known, {headline}"
    return headline, told


def _split(lines: Sequence[TrackerResult], winners: dict[str, str]) -> tuple[str, str]:
    """Different trackers are closest on different recordings: `winners` by the recordings' paths."""
    labels = list(dict.fromkeys(line.label for line in lines))
    headline = f"{'Neither' if len(labels) == 2 else 'No'} tracker is the closest everywhere"
    if len(winners) > _MOST_NAMED:
        counts = {label: list(winners.values()).count(label) for label in labels}
        ordered = sorted((label for label in labels if counts[label]), key=lambda label: -counts[label])
        parts = [f"{label} on {counts[label]}" for label in ordered]
        return headline, f"Of {len(winners)} recordings, the closest is {listed(parts)}."
    parts = []
    for source, label in winners.items():
        own = [line for line in lines if line.source == source]
        best = next(line for line in own if line.label == label)
        told = f"{_mm(_error(best, lines) or 0)} {_name(best)}"
        if len(labels) == 2:
            other = next((line for line in own if line.label != label), None)
            error = None if other is None else _error(other, lines)
            told += "" if other is None or error is None else f"; {other.label} {_mm(error)}"
        parts.append(f"{label} on {best.recording} ({told})")
    return headline, f"Closest are {listed(parts)}."


def _elsewhere(lines: Sequence[TrackerResult]) -> str:
    """What E3D says of recordings that know no truth, beside others that do."""
    blind = [line for line in lines if judged_by(lines) != "e3d_mm" and line.truth is None]
    judged = _winners([line for line in blind if line.source not in {each.source for each in lines if each.truth}])
    if not judged:
        return ""
    counts = {label: list(judged.values()).count(label) for label in dict.fromkeys(judged.values())}
    told = listed([f"{label} on {count}" for label, count in sorted(counts.items(), key=lambda pair: -pair[1])])
    return f"Where no truth is known, the sensor's points lie nearest to {told} of {len(judged)}."


def _winners(lines: Sequence[TrackerResult]) -> dict[str, str]:
    """The label of the closest tracker on each recording that can be judged, by the recording's path."""
    found: dict[str, tuple[float, str]] = {}
    for line in lines:
        error = _error(line, lines)
        if error is not None and (line.source not in found or error < found[line.source][0]):
            found[line.source] = (error, line.label)
    return {source: label for source, (_, label) in found.items()}


def _all_judged(lines: Sequence[TrackerResult]) -> bool:
    """Whether every recording says how close trackers are."""
    return set(_winners(lines)) == {line.source for line in lines}


def _error(line: TrackerResult, lines: Sequence[TrackerResult]) -> float | None:
    """What a line is judged by, mm: its error; where no recording knows a truth, its E3D."""
    return line.figure("e3d_mm", "median") if judged_by(lines) == "e3d_mm" else line.error("mean")


def _name(line: TrackerResult) -> str:
    return ERRORS[line.truth or "e3d_mm"]


def _speeds(found: Sequence[Standing], equal_ms: float | None) -> str:
    timed = sorted(((s.ms, s.label) for s in found if s.ms is not None), key=lambda pair: pair[0])
    if len(timed) < 2:
        return ""
    told = listed([f"{label} {ms:.1f}{_SPACE}ms" for ms, label in timed])
    if equal_ms is not None:
        return f"Each was given {equal_ms:g}{_SPACE}ms a frame; taken were: {told}."
    (fast, quickest), (slow, slowest) = timed[0], timed[-1]
    if fast <= 0 or slow < ALIKE * fast:
        return f"They take the same time a frame: {told}."
    if len(timed) == 2:
        return f"{quickest} is faster: {fast:.1f}{_SPACE}ms a frame, {slowest} {slow:.1f}{_SPACE}ms."
    return f"{quickest} is the fastest: {told} a frame."


def _losses(found: Sequence[Standing]) -> str:
    if all(standing.lost == 0 for standing in found):
        return "The hand was never lost."
    lost = [f"{s.label} in {s.lost} of {s.frames} frames" for s in found if s.lost]
    never = [s.label for s in found if not s.lost]
    return f"The hand was lost by {listed(lost)}" + (f"; never by {listed(never)}." if never else ".")


def _mm(value: float) -> str:
    number = f"{value:.2f}" if value < 0.995 else f"{value:.1f}" if value < 99.5 else f"{value:.0f}"
    return f"{number}{_SPACE}mm"


def listed(parts: Sequence[str]) -> str:
    """The parts as a sentence lists them."""
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"


def _count(number: int) -> str:
    words = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")
    return words[number] if number < len(words) else str(number)

"""The page's headline and summary sentences, generated from the results of a comparison."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from depthtrack.evaluation.compare.results import TRACKER_MS, TrackerResult

TIE_FACTOR = 1.05
"""Values that differ by less than this factor count as equal."""
_MOST_NAMED = 3
"""Recordings that a sentence names one by one; more are counted."""
_SPACE = "\u00a0"
"""No-break space between a number and its unit."""

ERRORS = {"endpoint_error_mm": "mean endpoint error", "joint_error_mm": "mean joint error", "e3d_mm": "median E3D"}
"""Names of the metrics that rank trackers."""


@dataclass(frozen=True)
class Summary:
    """The headline of a page and the sentences below it."""

    headline: str
    sentences: tuple[str, ...]


@dataclass(frozen=True)
class TrackerSummary:
    """A tracker over all recordings.

    error: mean over the recordings of its error, mm; infinite if a recording that ranks others lacks it.
    ms: mean over the recordings of its median time a frame without segmentation, milliseconds.
    lost: number of lost frames among `frames`.
    """

    label: str
    error: float
    ms: float | None
    lost: int
    frames: int


def error_metric(results: Sequence[TrackerResult]) -> str:
    """Return the metric that ranks trackers: E3D if no recording has ground truth."""
    return next((result.truth for result in results if result.truth is not None), "e3d_mm")


def error_name(results: Sequence[TrackerResult]) -> str:
    """Return the name of the errors that rank trackers."""
    truths = {result.truth for result in results if result.truth is not None}
    return "mean error" if len(truths) > 1 else ERRORS[error_metric(results)]


def recording_scope(results: Sequence[TrackerResult]) -> str:
    """Return a sentence's end that names the recordings in the ranking; empty for a single one."""
    every, ranked = {result.source for result in results}, _winners(results)
    if not _all_ranked(results):
        return f" on the {_count(len(ranked))} of {_count(len(every))} recordings with ground truth"
    return " over all recordings" if len(every) > 1 else ""


def tracker_summaries(results: Sequence[TrackerResult]) -> list[TrackerSummary]:
    """Return all trackers in the order of their errors, the smallest first."""
    ranked = set(_winners(results))
    found = []
    for label in dict.fromkeys(result.label for result in results):
        own = [result for result in results if result.label == label]
        errors = {result.source: error for result in own if (error := _error(result, results)) is not None}
        times = [ms for result in own if (ms := result.figure(TRACKER_MS, "median")) is not None]
        found.append(
            TrackerSummary(
                label,
                float(np.mean(list(errors.values()))) if errors and ranked <= set(errors) else float("inf"),
                float(np.mean(times)) if times else None,
                sum(result.lost for result in own),
                sum(result.frames for result in own),
            )
        )
    return sorted(found, key=lambda tracker: tracker.error)


def summary(
    results: Sequence[TrackerResult], equal_ms: float | None = None, matched_model: Sequence[str] = ()
) -> Summary:
    """Return the headline and the sentences of a comparison.

    equal_ms: time budget of a frame, milliseconds, if all trackers had the same.
    matched_model: trackers that fit the hand model that every recording was rendered from.
    """
    found = tracker_summaries(results)
    first = found[0]
    if not np.isfinite(first.error):
        return Summary("No tracker found the hand", (_losses(found),))
    if len(found) == 1:
        time = "" if first.ms is None else f"It takes {first.ms:.1f}{_SPACE}ms a frame."
        headline = f"{first.label} has a {error_name(results)} of {_mm(first.error)}"
        return Summary(headline, tuple(filter(None, (time, _losses(found)))))
    winners = _winners(results)
    several = len(set(winners.values())) > 1
    headline, sentence = _several_winners(results, winners) if several else _one_winner(results, found)
    if matched_model:
        headline += f", on a hand rendered from the model of {enumeration(matched_model)}"
    sentences = (sentence, _without_truth(results), _times(found, equal_ms), _losses(found))
    return Summary(headline, tuple(filter(None, sentences)))


def _one_winner(results: Sequence[TrackerResult], found: Sequence[TrackerSummary]) -> tuple[str, str]:
    """Return headline and sentence if one tracker has the smallest error on every recording."""
    first, *others = [tracker for tracker in found if np.isfinite(tracker.error)]
    against = [f"{tracker.label}'s {_mm(tracker.error)}" for tracker in others]
    sentence = f"{first.label}'s {error_name(results)} is {_mm(first.error)}{recording_scope(results)}"
    sentence += f", {enumeration(against)}." if against else "."
    equal = [tracker.label for tracker in found if tracker.error < TIE_FACTOR * first.error]
    if len(equal) > 1:
        headline = f"{enumeration(equal)} are equally accurate"
    elif len(found) == 2:
        headline = f"{first.label} is more accurate than {found[1].label}"
    else:
        headline = f"{first.label} is the most accurate of {_count(len(found))} trackers"
    headline = headline if _all_ranked(results) else f"On recordings with ground truth, {headline}"
    return headline, sentence


def _several_winners(results: Sequence[TrackerResult], winners: dict[str, str]) -> tuple[str, str]:
    """Return headline and sentence if the most accurate tracker differs between recordings."""
    labels = list(dict.fromkeys(result.label for result in results))
    headline = f"{'Neither' if len(labels) == 2 else 'No'} tracker is the most accurate on every recording"
    if len(winners) > _MOST_NAMED:
        counts = {label: list(winners.values()).count(label) for label in labels}
        ordered = sorted((label for label in labels if counts[label]), key=lambda label: -counts[label])
        parts = [f"{label} on {counts[label]}" for label in ordered]
        return headline, f"Of {len(winners)} recordings, the most accurate is {enumeration(parts)}."
    parts = []
    for source, label in winners.items():
        own = [result for result in results if result.source == source]
        best = next(result for result in own if result.label == label)
        values = f"{_mm(_error(best, results) or 0)} {_name(best)}"
        if len(labels) == 2:
            other = next((result for result in own if result.label != label), None)
            error = None if other is None else _error(other, results)
            values += "" if other is None or error is None else f"; {other.label} {_mm(error)}"
        parts.append(f"{label} on {best.recording} ({values})")
    return headline, f"The most accurate are {enumeration(parts)}."


def _without_truth(results: Sequence[TrackerResult]) -> str:
    """Return the E3D ranking of recordings without ground truth, if others have it."""
    unknown = [result for result in results if error_metric(results) != "e3d_mm" and result.truth is None]
    with_truth = {result.source for result in results if result.truth}
    winners = _winners([result for result in unknown if result.source not in with_truth])
    if not winners:
        return ""
    counts = {label: list(winners.values()).count(label) for label in dict.fromkeys(winners.values())}
    parts = [f"{label} on {count}" for label, count in sorted(counts.items(), key=lambda pair: -pair[1])]
    return f"Of the recordings without ground truth, the lowest E3D is that of {enumeration(parts)} of {len(winners)}."


def _winners(results: Sequence[TrackerResult]) -> dict[str, str]:
    """Return the label of the most accurate tracker by the path of each ranked recording."""
    found: dict[str, tuple[float, str]] = {}
    for result in results:
        error = _error(result, results)
        if error is not None and (result.source not in found or error < found[result.source][0]):
            found[result.source] = (error, result.label)
    return {source: label for source, (_, label) in found.items()}


def _all_ranked(results: Sequence[TrackerResult]) -> bool:
    """Return whether every recording ranks the trackers."""
    return set(_winners(results)) == {result.source for result in results}


def _error(result: TrackerResult, results: Sequence[TrackerResult]) -> float | None:
    """Return the error that ranks a result, mm: E3D if no recording has ground truth."""
    return result.figure("e3d_mm", "median") if error_metric(results) == "e3d_mm" else result.error("mean")


def _name(result: TrackerResult) -> str:
    return ERRORS[result.truth or "e3d_mm"]


def _times(found: Sequence[TrackerSummary], equal_ms: float | None) -> str:
    timed = sorted(((t.ms, t.label) for t in found if t.ms is not None), key=lambda pair: pair[0])
    if len(timed) < 2:
        return ""
    times = enumeration([f"{label} {ms:.1f}{_SPACE}ms" for ms, label in timed])
    if equal_ms is not None:
        return f"The time budget was {equal_ms:g}{_SPACE}ms a frame; measured: {times}."
    (fast, quickest), (slow, slowest) = timed[0], timed[-1]
    if fast <= 0 or slow < TIE_FACTOR * fast:
        return f"They take the same time a frame: {times}."
    if len(timed) == 2:
        return f"{quickest} is faster: {fast:.1f}{_SPACE}ms a frame, {slowest} {slow:.1f}{_SPACE}ms."
    return f"{quickest} is the fastest: {times} a frame."


def _losses(found: Sequence[TrackerSummary]) -> str:
    if all(tracker.lost == 0 for tracker in found):
        return "The hand was never lost."
    lost = [f"{t.label} in {t.lost} of {t.frames} frames" for t in found if t.lost]
    never = [t.label for t in found if not t.lost]
    return f"The hand was lost by {enumeration(lost)}" + (f"; never by {enumeration(never)}." if never else ".")


def _mm(value: float) -> str:
    number = f"{value:.2f}" if value < 0.995 else f"{value:.1f}" if value < 99.5 else f"{value:.0f}"
    return f"{number}{_SPACE}mm"


def enumeration(parts: Sequence[str]) -> str:
    """Join parts by commas and a final "and"."""
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"


def _count(number: int) -> str:
    words = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")
    return words[number] if number < len(words) else str(number)

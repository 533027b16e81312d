"""From what a file states to a capture: labels, gaps, units and rate, each change noted."""

import re
from collections import Counter

import numpy as np

from depthtrack.errors import InputError
from depthtrack.markers.capture import UNLABELLED, MarkerCapture
from depthtrack.markers.formats.stored_capture import StoredCapture
from depthtrack.types import Array, Mask

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001}
"""Lengths in metres of the units of files."""
DEFAULT_RATE = 120.0
"""Rate, Hz, of a file that states none, if the user states none either: that of most optical systems."""
LARGEST_RATE = 1e5
"""Largest rate accepted, Hz."""
_UNIT_NAMES = {
    "metre": "m",
    "meter": "m",
    "centimetre": "cm",
    "centimeter": "cm",
    "millimetre": "mm",
    "millimeter": "mm",
}
_UNIDENTIFIED = re.compile(r"(?:.*:)?(?:unlabell?ed|unidentified)[ _:-]*(\d*)", re.IGNORECASE)
_NEAREST, _FARTHEST = 0.002, 1.0
"""Distances between neighbouring markers, metres, outside which a file's unit is questioned."""
_SHORTEST_MM, _LONGEST_M = 8.0, 0.4
"""Distance between neighbouring markers: from the first on it is in millimetres, below the second in metres.

It is 20 to 30 mm on hands, and 60 to 100 mm on bodies and rigid bodies.
"""


def to_capture(stored: StoredCapture, rate: float | None = None, unit: str | None = None) -> MarkerCapture:
    """Return a capture in metres with labels that differ and NaN in its gaps.

    rate: Hz, in place of that of the file.
    unit: m, cm or mm, in place of that of the file.

    Raises:
        InputError: if the rate or the unit is unusable.
    """
    labels, label_notes = _labels(stored.labels, stored.positions.shape[1])
    measured, gap_notes = _measured(stored)
    positions = np.where(measured[..., None], stored.positions, np.nan)
    name, unit_notes = _unit(positions, stored.unit, unit)
    scale = METRES[name]
    positions *= scale
    hertz, rate_notes = _rate(stored.rate, rate)
    residuals = stored.residuals
    if residuals is not None:
        residuals = np.where(measured & (residuals >= 0), residuals, np.nan) * scale
    first = () if stored.first_frame == 1 else (f"the first frame in the file is {stored.first_frame}",)
    notes = (*stored.notes, *label_notes, *gap_notes, *unit_notes, *rate_notes, *first)
    return MarkerCapture(hertz, labels, positions, residuals, stored.first_frame, notes, name)


def _labels(stated: tuple[str, ...], count: int) -> tuple[tuple[str, ...], list[str]]:
    """Return `count` different labels: without prefix, blank and repeated ones numbered."""
    labels, notes = [_clean(label) for label in stated], list[str]()
    if len(labels) > count:
        notes.append(f"{len(labels) - count} labels have no trajectory and are dropped, from '{labels[count][:40]}' on")
    labels = (labels + [""] * count)[:count]
    subjects = {label.partition(":")[0] for label in labels if ":" in label[1:] and not label.startswith(UNLABELLED)}
    if len(subjects) == 1:
        (subject,) = subjects
        labels = [label.removeprefix(f"{subject}:") or label for label in labels]
        notes.append(f"the prefix '{subject[:40]}:' is removed from the labels")
    elif subjects:
        notes.append(f"the prefixes of {len(subjects)} subjects are kept in the labels")
    blank = labels.count("")
    if blank:
        notes.append(f"{blank} trajectories have no label and are numbered with '{UNLABELLED}'")
    repeated = [label for label, times in Counter(filter(None, labels)).items() if times > 1]
    if repeated:
        notes.append(
            f"the labels of {len(repeated)} trajectories are repeated and get a number, '{repeated[0][:40]}' first"
        )
    return _distinct(labels), notes


def _clean(label: str) -> str:
    """Return a label without control characters; an unidentified one begins with `*`."""
    label = "".join(c for c in label if c.isprintable()).strip()
    unidentified = _UNIDENTIFIED.fullmatch(label)
    return f"{UNLABELLED}{unidentified[1]}" if unidentified else label


def _distinct(labels: list[str]) -> tuple[str, ...]:
    used, result = {label for label in labels if label not in ("", UNLABELLED)}, list[str]()
    seen: set[str] = set()
    number = Counter[str]()
    for label in labels:
        stem = UNLABELLED if label in ("", UNLABELLED) else f"{label}_"
        new = label
        while new in seen or (new != label and new in used) or new in ("", UNLABELLED):
            number[stem] += 1
            new = f"{stem}{number[stem] + (stem != UNLABELLED)}"
        seen.add(new)
        result.append(new)
    return tuple(result)


def _measured(stored: StoredCapture) -> tuple[Mask, list[str]]:
    """Return the measured samples (T, M): finite, residual not below 0, no bare 0 0 0."""
    finite = np.isfinite(stored.positions).all(axis=-1)
    zero = (stored.positions == 0).all(axis=-1)
    if stored.residuals is None:
        kept, gaps = 0, int(zero.sum())
        measured = finite & ~zero
    else:
        rejected = stored.residuals < 0
        known = stored.residuals >= 0
        kept, gaps = int((zero & known).sum()), int((zero & finite & ~known & ~rejected).sum())
        measured = finite & ~rejected & (~zero | known)
    notes = []
    if gaps:
        notes.append(f"{gaps} samples are 0 0 0 and are read as gaps")
    if kept:
        notes.append(f"{kept} samples are 0 0 0 with a residual and are kept")
    return np.asarray(measured), notes


def _unit(positions: Array, stated: str | None, chosen: str | None) -> tuple[str, list[str]]:
    """Return the unit: the user's, the file's, else by the size of the hand."""
    if chosen is not None:
        if chosen not in METRES:
            raise InputError(f"the unit must be one of {', '.join(METRES)}, found '{chosen[:40]}'")
        return chosen, [f"the unit is {chosen}, as chosen"]
    text = "" if stated is None else "".join(c for c in stated if c.isprintable()).strip().lower()
    name = _UNIT_NAMES.get(text.rstrip("s"), text)
    distance = neighbour_distance(positions)
    if name in METRES:
        metres = METRES[name] * distance
        likely = np.isnan(metres) or _NEAREST <= metres <= _FARTHEST
        doubt = f"neighbouring markers are {metres:.3g} m apart by the file's unit, {name}: is it right?"
        return name, [] if likely else [doubt]
    guess = "m" if distance < _LONGEST_M else "mm" if distance >= _SHORTEST_MM else "cm"
    why = "the file states no unit" if not text else f"the unit '{text[:20]}' is unknown"
    size = "" if np.isnan(distance) else f": neighbouring markers are {distance:.3g} {guess} apart"
    return guess, [f"{why}; {guess} is taken by the size of the hand{size}"]


def neighbour_distance(positions: Array, frames: int = 50) -> float:
    """Return the median distance of a marker (T, M, 3) to its nearest neighbour.

    frames: evenly spaced, to look at. The result is NaN if none has two markers.
    """
    found = []
    for frame in np.unique(np.linspace(0, len(positions) - 1, frames).astype(int)):
        points = positions[frame][np.isfinite(positions[frame]).all(axis=-1)][:500]
        if len(points) > 1:
            distances = np.linalg.norm(points[:, None] - points[None], axis=-1)
            np.fill_diagonal(distances, np.inf)
            found.append(distances.min(axis=1))
    return float(np.median(np.concatenate(found))) if found else np.nan


def _rate(stated: float | None, chosen: float | None) -> tuple[float, list[str]]:
    rate = stated if chosen is None else chosen
    if rate is not None and not 0 < rate <= LARGEST_RATE:
        raise InputError(f"the rate must be above 0 and at most {LARGEST_RATE:g} Hz, found {rate:g}")
    if rate is None:
        return DEFAULT_RATE, [f"the file states no rate; {DEFAULT_RATE:g} Hz is taken: state it if it is another"]
    if chosen is not None and stated is not None and abs(chosen - stated) > 1e-6 * stated:
        return rate, [f"the rate is {chosen:g} Hz, as chosen; the file states {stated:g} Hz"]
    return rate, []

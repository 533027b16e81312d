"""Checks of the depth of a recording: missing readings, units, raw disparity.

They need only the histogram of the stored values. Each finding is a sentence with its remedy.
"""

from collections.abc import Iterator

import numpy as np

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.recording.depth_histogram import LARGEST_STORED, percentile, sampled_histogram
from depthtrack.recording.registry import reading_of
from depthtrack.recording.sequence import Sequence
from depthtrack.types import Array, Index

_SATURATED_SHARE = 0.002
"""Share of pixels of the largest value of a sensor that is reported."""
_CONSTANT_SHARE = 0.15
"""Share of pixels of one value that is reported; noise spreads a wall over many values."""
_WALL_RANGE, _WALL_SHARE = 0.03, 0.05
"""Relative range of depth beside a value, and the share of its pixels there, that show a surface with noise."""
_NEAREST_READING = 0.12
"""Depth that no sensor for hands reads below, metres."""
_FARTHEST_HAND = 3.0
"""Depth that no hand is tracked beyond, metres."""
_FARTHEST_ROOM = 10.0
"""Depth that no sensor for hands measures half of its pixels beyond, metres."""
_HAND_DEPTHS = (0.25, 1.5)
"""Depths that a recorded hand has, metres."""
_ROOM_WITHIN = 0.7
"""Depth that no room lies within, metres."""
_FEWEST_EXPLAINED = 2 / 3
"""Agreement of silhouettes that a tracked hand exceeds in some frames, and a surface of another size in none."""
_MOSTLY = 0.9
"""Share of the frames that are below it if none shows a hand."""
_COMMON_SCALES = {0.001: "1 mm", 0.0001: "0.1 mm", 0.0002: "0.2 mm", 0.00025: "0.25 mm", 0.000125: "0.125 mm"}
"""Units of the depth of common sensors and data sets, metres."""
_DISPARITY_MISSING = 2047
"""Raw disparity of Kinect v1 without a reading: eleven bits."""
_DISPARITIES = (250, 1092)
"""Raw disparities of Kinect v1 between 0.3 m and infinity."""
_DISPARITY_ROOM, _ROOM_SHARE = 860, 0.5
"""Raw disparity at 1.5 m, and the share of the readings that is farther in a room."""
_CONVERSION = "convert it by depth = 1 / (3.33 - 0.00307 * value) metres"
_BYTE = 255


def depth_notes(histogram: Index, camera: Camera) -> list[str]:
    """Return what is unusual in the depth of a recording.

    histogram: (65536,) count of the pixels of each stored value.
    """
    readings = histogram.copy()
    readings[0] = 0
    if not readings.any():
        return []
    if (disparity := _disparity(readings)) is not None:
        return [disparity]
    if (coarse := _too_few_bits(readings)) is not None:
        return [coarse]
    notes = list(_values_without_meaning(readings, int(histogram.sum()), camera))
    return [*notes, *_units(readings, camera), *_possible_disparity(readings, camera)]


def check_depth(sequence: Sequence) -> None:
    """Check that a hand can be seen in the depth of a recording, unless its unit was stated.

    Raises:
        InputError: if the depth is raw disparity, of 8 bits, or in another unit than the camera states.
    """
    if not sequence.has_depth or reading_of(sequence).depth_scale is not None:
        return
    reason = unusable_depth(sampled_histogram(sequence), sequence.camera)
    if reason is not None:
        scale = sequence.camera.depth_scale
        raise InputError(f"{sequence.name}: {reason}; if {1000 * scale:g} mm is right, give --depth-scale {scale:g}")


def unusable_depth(histogram: Index, camera: Camera) -> str | None:
    """Return why no hand can be tracked in the depth of a recording; None if one may be.

    histogram: (65536,) count of the pixels of each stored value.
    """
    readings = histogram.copy()
    readings[0] = 0
    if not readings.any():
        return None
    sure = _disparity(readings) or _too_few_bits(readings)
    if sure is not None:
        return sure
    list(_values_without_meaning(readings, int(histogram.sum()), camera))
    if not readings.any():
        return None
    shares = (0.001, 0.02, 0.5, 0.98)
    nearest, low, middle, high = (percentile(readings, share) * camera.depth_scale for share in shares)
    is_near = low < _NEAREST_READING and high < _ROOM_WITHIN
    is_far = nearest > _FARTHEST_HAND or middle > _FARTHEST_ROOM
    if not (is_near or is_far) or likely_scale(readings) is None:
        return None
    return next(_units(readings, camera), None)


def poor_agreement_note(sequence: Sequence, agreements: Array) -> str | None:
    """Return a sentence if no pose of a run explains what the camera saw; None otherwise.

    agreements: (N,) agreement of the silhouettes in the frames with a pose.
    """
    if not len(agreements):
        return None
    usual = float(np.quantile(agreements, _MOSTLY))
    if usual >= _FEWEST_EXPLAINED:
        return None
    return no_hand_note(
        sequence,
        f"what was tracked is no hand: nine poses of ten explain at most {100 * usual:.0f} % of what the camera saw",
    )


def no_hand_note(sequence: Sequence, found: str = "no hand was found in any frame") -> str:
    """Return a sentence on a recording without a hand: depth range and likely unit."""
    histogram = sampled_histogram(sequence)
    if not histogram[1:].any():
        return f"{found}: the depth images have no readings"
    scale = sequence.camera.depth_scale
    low, high = (percentile(histogram, share) * scale for share in (0.02, 0.98))
    text = f"{found}: depth runs from {low:.2f} to {high:.2f} m in units of {1000 * scale:g} mm"
    likely = likely_scale(histogram)
    if likely is None or np.isclose(likely, scale):
        return f"{text}; a hand must be one of the nearest objects, 0.2 to 1.5 m away (`depthtrack segment` shows it)"
    return f"{text}; if that is wrong, {_COMMON_SCALES[likely]} is the likely unit: give --depth-scale {likely:g}"


def likely_scale(histogram: Index) -> float | None:
    """Return a common unit, metres, that puts the nearest surfaces where hands are."""
    nearest = percentile(histogram, 0.02)
    fitting = [scale for scale in _COMMON_SCALES if _HAND_DEPTHS[0] <= nearest * scale <= _HAND_DEPTHS[1]]
    return fitting[0] if fitting else None


def _values_without_meaning(readings: Index, pixels: int, camera: Camera) -> Iterator[str]:
    """Yield a sentence on the value that may mean no reading."""
    value, share = int(np.argmax(readings)), float(readings.max() / pixels)
    saturated = float(readings[LARGEST_STORED] / pixels)
    if saturated >= _SATURATED_SHARE:
        value, share = LARGEST_STORED, saturated
    elif share < _CONSTANT_SHARE or _is_surface(readings, value):
        return
    yield (
        f"the stored value {value} ({value * camera.depth_scale:.3g} m) covers {100 * share:.1f} % of the pixels:"
        f" if it means no reading, give --invalid {value}"
    )
    readings[value] = 0


def _is_surface(readings: Index, value: int) -> bool:
    """Return whether neighbours of a value are readings too, as on a noisy wall."""
    near = readings[int((1 - _WALL_RANGE) * value) : int((1 + _WALL_RANGE) * value) + 1].sum() - readings[value]
    return bool(near > _WALL_SHARE * readings[value])


def _units(readings: Index, camera: Camera) -> Iterator[str]:
    if not readings.any():
        return
    low, middle, high = (percentile(readings, share) * camera.depth_scale for share in (0.02, 0.5, 0.98))
    if _NEAREST_READING <= low <= _FARTHEST_HAND and middle <= _FARTHEST_ROOM:
        return
    found = f"depth runs from {low:.2f} to {high:.2f} m, where no hand is tracked"
    scale = likely_scale(readings)
    if scale is None:
        yield f"{found}: state the unit of the depth with --depth-scale METRES"
        return
    near, far = (percentile(readings, share) * scale for share in (0.02, 0.98))
    unit = f"a unit of {_COMMON_SCALES[scale]} (--depth-scale {scale:g})"
    yield f"{found}: with {unit} it runs from {near:.2f} to {far:.2f} m"


def _too_few_bits(readings: Index) -> str | None:
    """Return a sentence if the values are those of a picture of 8 bits."""
    if readings[_BYTE + 1 :].any():
        return None
    return (
        f"no stored value is above {_BYTE}: depth of 8 bits was saved as 16 bits, which lost its steps,"
        " so export 16-bit depth again"
    )


def _disparity(readings: Index) -> str | None:
    """Return a sentence if the values are raw disparities of Kinect v1."""
    missing = readings[_DISPARITY_MISSING]
    rest = readings.sum() - missing
    within = readings[_DISPARITIES[0] : _DISPARITIES[1] + 1].sum()
    if not missing or readings[_DISPARITY_MISSING + 1 :].any() or missing < _SATURATED_SHARE * readings.sum():
        return None
    if within < 0.98 * rest:
        return None
    share = 100 * missing / readings.sum()
    return (
        f"values end at {_DISPARITY_MISSING}, which covers {share:.1f} % of the readings: this is raw disparity of"
        f" Kinect v1, so {_CONVERSION}"
    )


def _possible_disparity(readings: Index, camera: Camera) -> Iterator[str]:
    """Yield a sentence if most readings lie where raw disparity of Kinect v1 has a room.

    No reading may lie beyond. In millimetres, that is a wall at 1 m, so depth cannot settle it. With 2047 it is sure.
    """
    first, last = np.flatnonzero(readings)[[0, -1]] if readings.any() else (0, 0)
    room = readings[_DISPARITY_ROOM : _DISPARITIES[1] + 1].sum()
    if np.isclose(camera.depth_scale, 0.001) and last <= _DISPARITIES[1] and room > _ROOM_SHARE * readings.sum():
        yield f"values run from {first} to {last}: if they are raw disparity of Kinect v1, {_CONVERSION}"

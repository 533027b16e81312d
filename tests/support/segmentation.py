"""Options of the segmentation that all differ from their defaults."""

from typing import Any

from depthtrack.options import parameters, with_options
from depthtrack.segmentation.options import SegmentationOptions


def changed_options(**values: Any) -> SegmentationOptions:
    """Return options with each number changed by a few percent or by one, and `values` replaced."""
    changed: dict[str, Any] = {"use_colour": False, "wrist_margin": 0.01, "occluder.find_occluder": True}
    for each in parameters(SegmentationOptions()):
        if each.path in changed or each.path in values:
            continue
        if isinstance(each.default, float):
            changed[each.path] = 0.97 * each.default
        elif isinstance(each.default, int):
            changed[each.path] = each.default - 1 if each.default > 1 else each.default + 1
        elif each.path.endswith("alternative_shifts"):
            changed[each.path] = tuple(0.97 * value for value in each.default)
    return with_options(SegmentationOptions(), changed | values)

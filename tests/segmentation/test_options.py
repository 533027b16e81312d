"""Options of the segmentation: JSON round trip, bounds, documentation, and a fast import."""

import json
import subprocess
import sys
from typing import Any

import pytest

from depthtrack.errors import InputError
from depthtrack.hand.shape import HandShape
from depthtrack.options import from_data, parameters, to_data, with_options
from depthtrack.segmentation.hand_size import AVERAGE_HAND, HandSize
from depthtrack.segmentation.options import SegmentationOptions
from tests.support.segmentation import changed_options


def test_all_options_survive_json() -> None:
    for options in (SegmentationOptions(), changed_options()):
        assert from_data(SegmentationOptions, json.loads(json.dumps(to_data(options))), "test") == options
        assert json.dumps(to_data(from_data(SegmentationOptions, to_data(options), "test"))) == json.dumps(
            to_data(options)
        )


def test_each_option_can_be_changed() -> None:
    usual = {each.path: each.default for each in parameters(SegmentationOptions())}
    new = {each.path: each.default for each in parameters(changed_options(skin_model="skin.json"))}
    new["skin_from"] = changed_options(skin_from=1).skin_from  # excludes skin_model
    assert [path for path, value in usual.items() if new[path] == value] == []


@pytest.mark.parametrize("value", [-2.0, 1e9, float("nan"), float("inf")])
def test_numbers_out_of_range_are_refused(value: float) -> None:
    for each in parameters(SegmentationOptions()):
        if isinstance(each.default, float):
            with pytest.raises(InputError):
                with_options(SegmentationOptions(), {each.path: value})


@pytest.mark.parametrize(
    "change",
    [
        {"slice_step": 0.0},
        {"bin_width": 0.0},
        {"node_size": 0.0},
        {"farthest": 0.05},
        {"nearest_guess": 0.2},
        {"prior": 1.0},
        {"bins": 10**9},
        {"dilation": 1.0},
        {"wrist_margin": 0.5},
    ],
)
def test_values_that_stop_or_exhaust_the_program_are_refused(change: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=next(iter(change))):
        with_options(SegmentationOptions(), change)


def test_each_option_has_a_meaning_of_one_line() -> None:
    for each in parameters(SegmentationOptions()):
        assert 10 < len(each.meaning) < 130, each.path
        assert not each.meaning.endswith(".")


def test_importing_the_options_imports_no_numpy() -> None:
    code = "import sys, depthtrack.segmentation.options; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_sizes_follow_the_hand() -> None:
    child = HandSize.of(HandShape(scale=0.7))
    for name in ("palm_half_thickness", "wrist_to_palm", "reach"):
        assert getattr(child, name) == pytest.approx(0.7 * getattr(AVERAGE_HAND, name))
    assert AVERAGE_HAND.palm_half_thickness == HandShape().palm_thickness / 2
    assert AVERAGE_HAND.wrist_to_palm == HandShape().palm_length / 2

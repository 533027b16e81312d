"""Each numeric option has a range, which its default and its help respect, and which is checked before the work."""

import math
from importlib import import_module
from pathlib import Path
from typing import Any, get_args

import pytest

from depthtrack.calibration.options import CalibrationOptions, OngoingOptions, ViewChoiceOptions
from depthtrack.cli import COMMANDS, main
from depthtrack.cli.markers import COMMANDS as MARKER_COMMANDS
from depthtrack.cli.stated_default import ShownDefault
from depthtrack.errors import InputError
from depthtrack.markers.filling.options import FillOptions
from depthtrack.markers.initialisation.options import InitialisationOptions
from depthtrack.markers.labelling.linking import LinkingOptions
from depthtrack.markers.labelling.options import LabellingOptions
from depthtrack.options import Parameter, check_ranges, parameters, with_options
from depthtrack.ranges import Range
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.tracking.configuration import CONFIGURATIONS
from tests.robustness.test_outputs import arguments_of, types_in

CONFIGURED = [
    *(kind() for kind in CONFIGURATIONS.values()),
    *(SegmentationOptions(), LabellingOptions(), FillOptions(), InitialisationOptions(), LinkingOptions()),
    *(CalibrationOptions(), OngoingOptions(), ViewChoiceOptions()),
]


def distinct() -> list[tuple[Any, list[Parameter]]]:
    """Return each configuration with the options that no earlier one has, since trackers share their groups."""
    seen: set[tuple[Any, ...]] = set()
    found = []
    for configuration in CONFIGURED:
        new = [each for each in parameters(configuration) if (each.meaning, each.range) not in seen]
        seen |= {(each.meaning, each.range) for each in new}
        found.append((configuration, new))
    return found


def is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def beyond(option: Parameter) -> list[Any]:
    """Return values beyond both ends of an option's range."""
    found = option.range
    assert found is not None
    ends = [found.least - 1, math.nan, *([] if math.isinf(found.most) else [found.most + 1, math.inf])]
    if isinstance(option.default, int) or "float" not in str(option.kind):
        ends = [int(end) for end in ends if math.isfinite(end)]
    return [tuple(end for _ in option.default) if isinstance(option.default, tuple) else end for end in ends]


@pytest.mark.parametrize(("configuration", "options"), distinct())
def test_configurations_state_ranges_and_hold_to_them(configuration: Any, options: list[Parameter]) -> None:
    for option in options:
        numbers = option.default if isinstance(option.default, tuple) else (option.default,)
        if option.range is None:
            assert not any(map(is_number, numbers)), option.path
            continue
        option.range.check(option.default, option.path)
        for value in beyond(option):
            with pytest.raises(InputError, match=rf"{option.path.rpartition('.')[2]} (must be|needs)"):
                with_options(configuration, {option.path: value})


@pytest.mark.parametrize(("configuration", "options"), distinct())
def test_ends_of_ranges_can_be_set(configuration: Any, options: list[Parameter]) -> None:
    """Both ends are accepted, but for those that another option forbids."""
    refused = set()
    for option in options:
        if option.range is None or isinstance(option.default, tuple):
            continue
        for end in (option.range.least, option.range.most):
            value = end if isinstance(option.default, float) else int(end)
            try:
                with_options(configuration, {option.path: value})
            except InputError:
                refused.add(option.path.rpartition(".")[2])
    assert refused <= {"components", "nearest", "farthest", "nearest_guess", "farthest_guess", "prior", *_EXCLUSIVE}


_EXCLUSIVE = {"seen_again", "reappears", "cognitive", "social"}
"""Options whose ends another condition excludes."""


def test_groups_inside_rounds_are_checked() -> None:
    from depthtrack.tracking.configuration import IkConfig
    from depthtrack.tracking.options import FitRound, FitSearchOptions

    with pytest.raises(InputError, match="keep must be from 1"):
        check_ranges(IkConfig(fit_search=FitSearchOptions((FitRound(keep=0),))))


def test_every_number_of_the_command_line_has_a_range() -> None:
    entries = [entry for entry in (COMMANDS | MARKER_COMMANDS).values() if entry.module != "depthtrack.cli.markers"]
    checked = 0
    for entry in entries:
        module = import_module(entry.module)
        kind = module.command([])[0] if hasattr(module, "command") else module.Command
        for name, hint in arguments_of(kind):
            marks = [getattr(mark, "help_behavior_hint", None) for mark in getattr(hint, "__metadata__", ())]
            ranges = [mark.range for mark in marks if isinstance(mark, ShownDefault) and mark.range is not None]
            assert bool(ranges) == bool({int, float} & set(types_in(hint))), f"{entry.module}: {name}"
            checked += len(ranges)
    assert checked > 300


def test_the_help_of_a_list_shows_no_empty_default() -> None:
    lists = 0
    for entry in (COMMANDS | MARKER_COMMANDS).values():
        module = import_module(entry.module)
        if entry.module == "depthtrack.cli.markers":
            continue
        kind = module.command([])[0] if hasattr(module, "command") else module.Command
        for name, hint in arguments_of(kind):
            if any(Ellipsis in get_args(each) for each in types_in(hint)):
                marks = [getattr(mark, "help_behavior_hint", None) for mark in getattr(hint, "__metadata__", ())]
                assert any(isinstance(mark, ShownDefault) for mark in marks), f"{entry.module}: {name}"
                lists += 1
    assert lists > 10


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("track", "S", "-o", "R", "--particles", "-1"), "--particles must be from 1 to 100000, found -1"),
        (("track", "S", "-o", "R", "--particles", "9" * 60), "--particles must be from 1 to 100000, found 999"),
        (("track", "S", "-o", "R", "--segmentation.node-size", "nan"), "--segmentation.node-size must be"),
        (("synth", "everyday", "S", "--seed", str(2**63)), "--seed must be from 0 to 9223372036854775807"),
        (("calibrate", "loop", "-o", "hand.json"), "cannot read loop: Too many levels of symbolic links"),
        (("track", "S", "-o", "R", "--skin-model", "loop"), "cannot read loop: Too many levels of symbolic links"),
        (("track", "S", "-o", "R", "--hand", "loop"), "cannot read loop: Too many levels of symbolic links"),
        (("info", "x" * 300), "File name too long"),
        (("compare", "S", "-o", "R", "--scheduler", "tls://127.0.0.1:8786"), "must have an address as tcp://"),
        (("compare", "S", "-o", "R", "--scheduler", "nonsense://x"), "must have an address as tcp://"),
    ],
)
def test_values_that_ended_with_a_traceback_or_were_accepted(
    arguments: tuple[str, ...],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "loop").symlink_to("loop")
    assert main(list(arguments)) == 2
    error = capsys.readouterr().err
    assert message in error
    assert len(error.splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["loop"]


@pytest.mark.parametrize(("range_", "text"), [(Range(0, 1), "from 0 to 1"), (Range(2, math.inf), "at least 2")])
def test_a_range_is_shown_by_the_help(range_: Range, text: str) -> None:
    assert str(range_) == text
    assert ShownDefault(range_)("3") == f"({text}; default: 3)"
    assert ShownDefault(range_)("None") == f"({text})"

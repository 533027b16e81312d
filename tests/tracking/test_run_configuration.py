"""Configuration of a run: JSON round trip, repeated runs, and earlier run folders."""

import importlib.metadata
import json
import math
import re
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import numpy as np
import pytest

from depthtrack import __version__
from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.hand.shape import HandShape
from depthtrack.options import Parameter, from_data, parameters, to_data, with_options
from depthtrack.recording import open_sequence
from depthtrack.recording.run_folder import read_configuration
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.tracking.configuration import CONFIGURATIONS, HybridConfig, IkConfig, PsoConfig, TrackerConfig
from depthtrack.tracking.earlier_runs import upgraded
from depthtrack.tracking.run import TrackingRun, configure
from depthtrack.tracking.run_configuration import RunConfiguration, versions
from tests.support.segmentation import changed_options

FRAMES = 3
KEPT = ("scoring.renderer", "search.attempts", "search.good_energy")
"""Options that keep their value: OpenGL may be missing, and a search must end soon."""
NEW = {"synergies.synergies": "leap", "synergies.components": 5, "scoring.resolution": 64, "fingers.resolution": 64}
NEW["deadline"] = 3.6e6  # no run takes so long, so that repeated runs have the same bits


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made") / "everyday"
    assert main(["synth", "everyday", str(folder), "--frames", str(FRAMES), "--model", "skin"]) == 0
    return folder


def changed(config: TrackerConfig) -> TrackerConfig:
    """Return a configuration in which every option differs from its default."""
    values = {each.path: _other(each) for each in parameters(config) if each.path not in KEPT}
    return with_options(config, values)


def _other(parameter: Parameter) -> Any:
    value = parameter.default
    if parameter.path in NEW:
        return NEW[parameter.path]
    if parameter.name.endswith("resolution") and value is None:
        return 64
    if isinstance(value, bool):
        return not value
    if get_origin(parameter.kind) is Literal:
        return next(other for other in get_args(parameter.kind) if other != value)
    if isinstance(value, int):
        return max(1, value - 1) if value > 1 else value + 1
    if isinstance(value, float):
        return 0.9 * value + 0.001 if math.isfinite(value) else 1.0
    if parameter.kind == tuple[float, ...] or (isinstance(value, tuple) and value and isinstance(value[0], float)):
        return tuple(0.9 * part + 0.001 for part in value) or (0.01,)
    assert isinstance(value, tuple), parameter
    return [part if isinstance(part, str) else to_data(part) for part in value[1:]]


ONE_FRAME = ("--tracker", "ik", "--frames", "1", "--hand", "truth")


@pytest.mark.parametrize("name", CONFIGURATIONS)
def test_a_configuration_round_trips_through_json(name: str) -> None:
    for config in (CONFIGURATIONS[name](), changed(CONFIGURATIONS[name]())):
        assert from_data(type(config), json.loads(json.dumps(to_data(config))), "test") == config
    usual = {each.path: each.default for each in parameters(CONFIGURATIONS[name]())}
    for each in parameters(config):
        assert each.default != usual[each.path] or each.path in KEPT, each.path


@pytest.mark.slow
@pytest.mark.parametrize("all_changed", [False, True])
@pytest.mark.parametrize("name", [name for name in CONFIGURATIONS if name != "lift"])  # needs a keypoint file
def test_a_run_is_repeated_from_its_configuration(
    recording: Path, tmp_path: Path, name: str, all_changed: bool
) -> None:
    """Only the command line and run.json are used the second time; the poses have the same bits."""
    config = CONFIGURATIONS[name]()
    config = with_options(changed(config) if all_changed else config, {"resolution": 64})
    sequence = open_sequence(recording)
    hand = HandShape(scale=1.0123456789)
    with TrackingRun(configure(recording, sequence, config, hand, frames=FRAMES - 1), sequence) as run:
        assert len(list(run.write(tmp_path / "first"))) == FRAMES - 1
    again = ["track", str(recording), "-o", str(tmp_path / "again"), "--config", str(tmp_path / "first" / "run.json")]
    assert main(again) == 0
    for file in ("poses.csv", "run.json"):
        assert (tmp_path / "again" / file).read_bytes() == (tmp_path / "first" / file).read_bytes()


def test_options_beside_a_configuration_replace_its_own(recording: Path, tmp_path: Path) -> None:
    first = ["track", str(recording), "-o", str(tmp_path / "first"), *ONE_FRAME]
    assert main([*first, "--subsample", "9", "--start", "truth"]) == 0
    again = ["track", str(recording), "-o", str(tmp_path / "again"), "--config", str(tmp_path / "first")]
    assert main([*again, "--icp-iterations", "2"]) == 0
    stored = read_configuration(tmp_path / "again")
    assert stored["tracker"] == "ik"
    assert (stored["frames"], stored["start"]) == (1, "truth")
    assert (stored["options"]["fit"]["subsample"], stored["options"]["fit"]["icp"]["icp_iterations"]) == (9, 2)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"tracker": "magic"}, "no tracker 'magic'"),
        ({"format": 99}, "expected format 6"),
        ({"options": {"colour": "red"}}, "colour"),
        ({"options": {"seed": "many"}}, "seed"),
        ({"frames": -1}, "whole number"),
        ({"camera": 3}, "entry 'camera'"),
        ({"start": "guess"}, "auto or truth"),
        ({"keypoints": 3}, "path of a file"),
        ({"keypoints": "x" * 2000}, "expected a path as keypoints"),
    ],
)
def test_a_malformed_configuration_is_rejected(recording: Path, change: dict[str, Any], expected: str) -> None:
    sequence = open_sequence(recording)
    fields = configure(recording, sequence, CONFIGURATIONS["ik"](), HandShape()).to_fields()
    with pytest.raises(InputError, match=expected):
        RunConfiguration.from_fields(fields | change, "run.json")


def test_runs_of_earlier_versions_are_read() -> None:
    earlier = {
        "sequence": "/data/everyday",
        "tracker": "pso",
        "variant": "default",
        "finish": "skin",
        "particles": 16,
        "resolution": None,
        "seed": 3,
        "skin_model": "skin.json",
        "camera": {},
        "hand": {},
        "label": "PSO",
    }
    found = RunConfiguration.from_fields(earlier, "run.json")
    assert found.surfaces == ("skin",)
    named = {"particles": 16, "seed": 3, "interval": 0.0, "refine": True, "surface_choice.surfaces": ("skin",)}
    named["final_fit.icp.posture_weight"] = 0.0
    expected = with_options(CONFIGURATIONS["pso"](), named)
    assert found.tracker == expected
    assert found.segmentation.skin_model == "skin.json"
    assert found.context == {"label": "PSO"}
    paper = {"tracker": "ik", "variant": "paper", "rounds": 7, "model": "cylinders", "synergies": "leap", "soft": True}
    options = {"icp_iterations": 7, "surface": "cylinders", "synergies": "leap", "synergy_prior": True}
    found = RunConfiguration.from_fields(earlier | paper, "run.json")
    assert found.tracker == with_options(CONFIGURATIONS["schroeder2014"](), {**options, "seed": 3})
    with pytest.raises(InputError, match="pso or ik"):
        upgraded({"tracker": "magic"}, "run.json")


def test_changed_files_are_rejected(recording: Path, tmp_path: Path) -> None:
    from depthtrack.hand.synergies import load_synergies, save_synergies

    file, folder = tmp_path / "mine.json", tmp_path / "run"
    save_synergies(load_synergies("leap"), file)
    config = with_options(CONFIGURATIONS["ik"](), {"synergies": str(file), "resolution": 48})
    sequence = open_sequence(recording)
    with TrackingRun(replace(configure(recording, sequence, config, HandShape()), frames=1), sequence) as run:
        assert len(list(islice(run.write(folder), 1))) == 1
    assert RunConfiguration.load(folder).tracker == config
    save_synergies(load_synergies("leap-grasps"), file)
    with pytest.raises(InputError, match="has changed since"):
        RunConfiguration.load(folder)


@pytest.mark.slow
@pytest.mark.parametrize("use_colour", [True, False])
def test_a_run_with_changed_segmentation_options_is_repeated(tmp_path: Path, use_colour: bool) -> None:
    """All options of the segmentation differ from their defaults, and so do the poses."""
    made, model, first = tmp_path / "made", tmp_path / "skin.json", tmp_path / "first"
    scene = ("--sensor", "kinect1", "--background", "room", "--model", "skin")
    assert main(["synth", "everyday", str(made), "--frames", str(FRAMES), *scene]) == 0
    assert main(["train-skin", str(made), "-o", str(model)]) == 0
    options = changed_options(use_colour=use_colour, skin_model=str(model))
    sequence, config = open_sequence(made), with_options(CONFIGURATIONS["ik"](), {"resolution": 64})
    poses = {}
    for name, segmentation in (("usual", SegmentationOptions()), ("first", options)):
        configuration = configure(made, sequence, config, HandShape(), segmentation)
        with TrackingRun(configuration, sequence) as run:
            poses[name] = [each.estimate.pose for each in run.write(tmp_path / name)]
    for usual, other in zip(poses["usual"], poses["first"], strict=True):
        assert usual is not None
        assert other is not None
        assert not np.array_equal(usual, other)
    again = ["track", str(made), "-o", str(tmp_path / "again"), "--config", str(first / "run.json")]
    assert main(again) == 0
    for file in ("poses.csv", "run.json"):
        assert (tmp_path / "again" / file).read_bytes() == (first / file).read_bytes()


def test_advanced_options_of_the_command_line_are_stored(recording: Path, tmp_path: Path) -> None:
    """Options of the tracker and of the segmentation that `--help` does not list are accepted."""
    first = ["track", str(recording), "-o", str(tmp_path / "first"), *ONE_FRAME]
    more = ["--segmentation.margin", "0.05", "--segmentation.grid.max-jump", "0.02", "--wrist-margin", "10"]
    assert main([*first, *more, "--retry-ratio", "1.4", "--start", "truth", "--depth-only"]) == 0
    again = ["track", str(recording), "-o", str(tmp_path / "again"), "--config", str(tmp_path / "first")]
    assert main([*again, "--no-depth-only"]) == 0
    for folder, depth_only in (("first", True), ("again", False)):
        configuration = read_configuration(tmp_path / folder)
        stored = configuration["segmentation"]
        assert configuration["options"]["retry_ratio"] == 1.4
        assert (stored["roi"]["margin"], stored["grid"]["max_jump"], stored["wrist_margin"]) == (0.05, 0.02, 0.01)
        assert configuration.get("reading", {}).get("depth_only", False) == depth_only


def test_a_run_of_format_2_keeps_its_memory_in_seconds() -> None:
    options = {"thresholds": {"memory_frames": 30, "energy": 0.5}}
    fields = {"format": 2, "sequence": "s", "camera": {}, "hand": {}, "tracker": "ik", "options": options}
    tracker = RunConfiguration.from_fields(fields, "run.json").tracker
    assert isinstance(tracker, IkConfig)
    thresholds = tracker.thresholds
    assert (thresholds.memory, thresholds.energy, thresholds.longest_gap) == (1.0, 0.5, math.inf)


@pytest.mark.parametrize("name", ["ik", "pso", "hybrid"])
def test_a_run_of_format_3_follows_no_branches(name: str) -> None:
    fields = {"format": 3, "sequence": "s", "camera": {}, "hand": {}, "tracker": name, "options": {"seed": 4}}
    tracker = RunConfiguration.from_fields(fields, "run.json").tracker
    assert isinstance(tracker, IkConfig | PsoConfig | HybridConfig)
    assert (tracker.branches.interval, tracker.seed) == (0.0, 4)


@pytest.mark.parametrize("segmentation", [{}, None, {"wrist_margin": 0.01}, {"search": {"nearest": 0.2}}])
def test_a_run_of_format_4_does_not_locate_a_lost_hand_anew(segmentation: Any) -> None:
    fields = {"format": 4, "sequence": "s", "camera": {}, "hand": {}, "tracker": "ik", "options": {}}
    found = RunConfiguration.from_fields(fields | {"segmentation": segmentation}, "run.json").segmentation
    assert found.search.lost_lifetime == 0
    given = segmentation or {}
    assert found.wrist_margin == given.get("wrist_margin", 0)
    assert found.search.nearest == given.get("search", {}).get("nearest", 0.1)


@pytest.mark.parametrize("segmentation", [{}, None, {"wrist_margin": 0.01}])
def test_a_run_of_format_5_finds_the_wrist_of_every_arm_alike(segmentation: Any) -> None:
    fields = {"format": 5, "sequence": "s", "camera": {}, "hand": {}, "tracker": "ik", "options": {}}
    found = RunConfiguration.from_fields(fields | {"segmentation": segmentation}, "run.json").segmentation
    assert found.foreshortened_wrist.least_cosine == 1
    assert found.wrist_margin == (segmentation or {}).get("wrist_margin", 0)


@pytest.mark.parametrize("options", [{}, {"seed": 4}, {"fit": {"icp": {"icp_iterations": 7}}}])
def test_a_run_of_format_5_holds_each_angle_alone(options: dict[str, Any]) -> None:
    fields = {"format": 5, "sequence": "s", "camera": {}, "hand": {}, "tracker": "ik", "options": options}
    tracker = RunConfiguration.from_fields(fields, "run.json").tracker
    assert isinstance(tracker, IkConfig)
    assert tracker.fit.icp.posture_weight == 0
    assert tracker.fit.icp.icp_iterations == options.get("fit", {}).get("icp", {}).get("icp_iterations", 5)


def test_the_versions_need_no_installed_metadata(monkeypatch: pytest.MonkeyPatch) -> None:
    """OpenCV comes in four packages, and a source tree may be used without installation."""
    monkeypatch.setattr(importlib.metadata, "version", None)
    stated = versions()
    assert stated["depthtrack"] == __version__
    assert all(re.match(r"\d+\.\d+", number) for number in stated.values())
    assert {"python", "numpy", "numba", "cv2", "scipy"} < stated.keys()

"""`depthtrack info`, and the options of all commands that open a recording."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.cli.reading_arguments import ReadingArguments
from depthtrack.cli.recording_options import PresetName, RecordingOptions
from depthtrack.geometry.camera import PRESETS, Camera
from depthtrack.hand.shape import HandShape, Side
from depthtrack.recording import SequenceWriter, open_sequence
from depthtrack.recording.summary import field_of_view
from depthtrack.tracking import side_choice
from depthtrack.tracking.side_choice import SideChoice
from tests.support.recordings import CAMERA, TIMES, depth_at, write_plain_tum, write_sample


@pytest.fixture
def sample(tmp_path: Path) -> Path:
    return write_sample(tmp_path / "sample")


@pytest.fixture
def info(capsys: pytest.CaptureFixture[str]) -> Any:
    """Return a function that runs `depthtrack info ... --json` and returns its data."""

    def run(*arguments: object) -> Any:
        assert main(["info", *map(str, arguments), "--json"]) == 0
        said = capsys.readouterr()
        assert said.err == ""
        return json.loads(said.out)

    return run


def refusal(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """Return the one sentence of an error of `depthtrack info`, with exit code 2."""
    assert main(["info", *map(str, arguments)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    return said.err


def test_the_figures_are_those_of_the_recording(info: Any, sample: Path) -> None:
    facts = info(sample)
    stored = np.rint(np.array([depth_at(index) for index in range(5)], dtype=np.float64) * 1000)
    readings = stored[stored > 0] / 1000
    assert facts["frames"] == facts["frames_read"] == len(TIMES)
    assert facts["duration"] == pytest.approx(0.4)
    assert facts["rate"] == pytest.approx(1 / np.median(np.diff(TIMES)))
    assert facts["gaps"] == [{"after": 0.1, "length": pytest.approx(0.3)}]
    assert facts["camera"] == json.loads(CAMERA.to_json())
    assert facts["missing"] == pytest.approx(48 / CAMERA.width / CAMERA.height)
    for percent, depth in facts["depth_percentiles"].items():
        expected = np.percentile(readings, float(percent), method="inverted_cdf")
        assert depth == pytest.approx(expected, abs=1e-9)
    for thing in ("colours", "masks", "exact_depths", "poses", "joints"):
        assert facts[thing] == len(TIMES)
    assert facts["hand"] == "left, scale 1"
    assert facts["description"]["motion"] == "plane"
    assert facts["damaged"] == []


def test_absent_parts_are_reported_as_absent(info: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with SequenceWriter(tmp_path / "bare", CAMERA) as out:
        out.append(5.0, np.zeros(CAMERA.shape))
    facts = info(tmp_path / "bare")
    assert facts["depth_percentiles"] is facts["rate"] is facts["hand"] is None
    assert facts["missing"] == 1
    for thing in ("duration", "colours", "masks", "exact_depths", "poses", "joints"):
        assert facts[thing] == 0
    assert main(["info", str(tmp_path / "bare")]) == 0
    text = capsys.readouterr().out
    for line in ("frames         1\n", "no reading; in steps of", "colour         none", "ground truth   none"):
        assert line in text


def test_the_text_has_millimetres_and_degrees(sample: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", str(sample)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["recording", "sample"]
    text = "\n".join(lines)
    for words in (
        "5 over 0.40 s, 29.85 Hz",
        "0.300 s after 0.100 s",
        "32x24, fx 30, fy 30.5",
        "56.1 x 42.9 degrees",
        "in steps of 1 mm",
        "6.2 % of the pixels",
        "poses in 5 frames",
        "hand sizes: left, scale 1",
        "motion: plane",
    ):
        assert words in text
    # One column of labels, one of values.
    assert all(line[14] == " " and line[15] != " " for line in lines)


def test_the_field_of_view_is_the_angle_between_the_outer_rays() -> None:
    edges = CAMERA.unproject([[-0.5, CAMERA.cy], [CAMERA.width - 0.5, CAMERA.cy]], [1.0, 1.0])
    left, right = edges / np.linalg.norm(edges, axis=1, keepdims=True)
    assert field_of_view(CAMERA)[0] == pytest.approx(np.arccos(left @ right))


def test_damaged_frames_end_the_command_or_are_listed(
    info: Any, sample: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (sample / "depth/0.067000.png").unlink()
    (sample / "hand_mask/0.100000.png").write_bytes(b"")
    assert "frame 2: " in refusal(capsys, sample)
    facts = info(sample, "--on-damage", "skip")
    assert [(frame["index"], frame["timestamp"]) for frame in facts["damaged"]] == [(2, 0.067), (3, 0.1)]
    assert facts["frames"] == 5
    assert facts["frames_read"] == facts["colours"] == 4
    assert facts["masks"] == 3
    assert main(["info", str(sample), "--on-damage", "skip"]) == 0
    text = capsys.readouterr().out
    assert "damaged        2 of 5 frames\n" in text
    assert "frame 2 at 0.067 s: " in text


def test_a_sample_reads_frames_from_end_to_end(info: Any, sample: Path) -> None:
    (sample / "depth/0.033000.png").unlink()  # not among the three that are read
    facts = info(sample, "--sample", 3)
    assert (facts["frames"], facts["frames_read"], facts["colours"], facts["joints"]) == (5, 3, 3, 5)
    assert facts["depth_percentiles"]["100"] == pytest.approx(depth_at(4).max(), abs=0.001)


def test_an_empty_sample_is_rejected(sample: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "--sample must be from 1" in refusal(capsys, sample, "--sample", 0)


def test_control_characters_of_a_recording_are_not_printed(sample: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (sample / "sequence.json").write_text(json.dumps({"note\x1b[2J": "\x1b]0;owned\x07" + "long" * 100}))
    assert main(["info", str(sample)]) == 0
    text = capsys.readouterr().out
    assert "\x1b" not in text
    assert "\x07" not in text
    assert max(map(len, text.splitlines())) < 240


def test_long_lists_are_shortened_visibly(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with SequenceWriter(tmp_path / "gaps", CAMERA) as out:
        for index in range(60):
            out.append(index * 0.1 + (index // 3) * 0.4, depth_at(0))
    assert main(["info", str(tmp_path / "gaps")]) == 0
    assert "... and 8 more" in capsys.readouterr().out


# Cameras from the command line.


def test_presets_on_the_command_line_are_those_of_the_library() -> None:
    assert set(get_args(PresetName)) == set(PRESETS)


def test_a_plain_tum_folder_takes_a_camera_in_numbers(info: Any, tmp_path: Path) -> None:
    path = write_plain_tum(tmp_path / "tum")
    facts = info(path, "--fx", 30, "--depth-scale", 0.0002)
    assert facts["camera"] == json.loads(Camera(32, 24, 30.0, 30.0, 15.5, 11.5, 0.0002).to_json())
    assert facts["colours"] == 5
    assert facts["depth_percentiles"]["100"] == pytest.approx(depth_at(4).max(), abs=0.0002)
    facts = info(path, "--fx", 30, "--fy", 31, "--cx", 14, "--cy", 10, "--depth-scale", 0.0002)
    assert facts["camera"] == json.loads(Camera(32, 24, 30.0, 31.0, 14.0, 10.0, 0.0002).to_json())


def test_a_camera_file_or_preset_can_be_corrected_in_numbers(tmp_path: Path) -> None:
    (tmp_path / "camera.json").write_text(CAMERA.to_json())
    path = write_plain_tum(tmp_path / "tum")
    opened = RecordingOptions(
        path, camera=tmp_path / "camera.json", reading=ReadingArguments(depth_scale=0.0002)
    ).open()
    np.testing.assert_allclose(opened[0].depth, depth_at(0), atol=0.00011)
    assert opened.camera == Camera(32, 24, 30.0, 30.5, 15.0, 11.0, 0.0002)
    assert RecordingOptions(path, camera_preset="tum").open().camera == PRESETS["tum"]
    assert RecordingOptions(path, camera_preset="kinect1", fx=500.0, cy=200.0).open().camera == Camera(
        640, 480, 500.0, 500.0, 319.5, 200.0, 0.001
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "has no camera.json"),
        (["--fx", "30"], "needs --fx and --depth-scale"),
        (["--cx", "30", "--depth-scale", "0.001"], "needs --fx and --depth-scale"),
        (["--fx", "0", "--depth-scale", "0.001"], "--fx must be from 0.01"),
        (["--fx", "nan", "--depth-scale", "0.001"], "--fx must be from 0.01"),
        (["--fx", "30", "--fy", "0", "--depth-scale", "0.001"], "--fy must be from 0.01"),
        (["--fx", "30", "--depth-scale", "5000"], "--depth-scale must be from"),
        (["--camera", "nowhere.json"], "cannot read the camera file: nowhere.json is missing"),
        (["--camera", "a.json", "--camera-preset", "tum"], "give one of them"),
        (["--camera-preset", "kinect1"], "must have the camera's 640x480 pixels, found 32x24"),
    ],
)
def test_unusable_camera_options_are_rejected(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    assert message in refusal(capsys, write_plain_tum(tmp_path / "tum"), *arguments)


# The side of the hand.


@pytest.mark.parametrize(
    ("stated", "choice", "line"),
    [
        (None, SideChoice("left", 0.3, True, 24), "a left hand: a right one fits 30 % worse in 24 frames"),
        (
            "right",
            SideChoice("left", 0.3, True, 24),
            "a left hand fits 30 % better than a right one in 24 frames: give",
        ),
        ("left", SideChoice("left", 0.3, True, 24), "a left hand: a right one fits 30 % worse in 24 frames"),
        (
            "right",
            SideChoice("left", 0.05, False, 24),
            "a left hand: a right one fits 5 % worse in 24 frames; the side",
        ),
        (None, SideChoice("right", 0.0, False, 0), "open: no hand was found"),
    ],
)
def test_the_side_that_fits_better_is_named(
    sample: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    stated: Side | None,
    choice: SideChoice,
    line: str,
) -> None:
    monkeypatch.setattr(side_choice, "choose_side", lambda *arguments: choice)
    (sample / "hand.json").unlink(missing_ok=True)
    if stated is not None:
        (sample / "hand.json").write_text(HandShape(side=stated).to_json())
    assert main(["info", str(sample), "--side"]) == 0
    assert f"side           {line}" in capsys.readouterr().out
    assert main(["info", str(sample), "--side", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["side"]["side"] == choice.side


def test_the_side_is_compared_on_demand(info: Any, sample: Path) -> None:
    assert info(sample)["side"] is None


# The program in a process.


def test_a_bad_folder_ends_the_program_with_code_2_and_no_traceback(sample: Path) -> None:
    (sample / "depth/0.000000.png").write_bytes((sample / "depth/0.000000.png").read_bytes()[:60])
    program = [sys.executable, "-m", "depthtrack", "info", str(sample)]
    ended = subprocess.run(program, capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    assert ended.stdout == ""
    assert ended.stderr.startswith("depthtrack info: frame 0: ")
    assert "Traceback" not in ended.stderr


def test_the_options_import_no_numerical_library() -> None:
    code = "import sys, depthtrack.cli.info as m; print({'numpy', 'cv2', 'scipy', 'numba'} & set(sys.modules))"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ended.stdout.strip() == "set()"


def test_real_recordings_are_summarised(info: Any, real_data: Path) -> None:
    facts = info(real_data / "rgbd" / "open-close")
    assert (facts["frames"], facts["colours"], facts["masks"], facts["joints"]) == (35, 35, 35, 35)
    assert facts["rate"] == pytest.approx(25, abs=0.5)
    assert len(facts["gaps"]) == 3
    sequence = open_sequence(real_data / "rgbd" / "open-close")
    depth = np.concatenate([frame.depth[frame.depth > 0] for frame in sequence])
    assert facts["depth_percentiles"]["50"] == pytest.approx(np.median(depth), abs=0.001)

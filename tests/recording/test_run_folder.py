"""A run folder reads back bitwise equal, whenever the writer is killed."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.errors import InputError
from depthtrack.hand.pose import ORIENTATION, POSE_NAMES
from depthtrack.hand.shape import HandShape
from depthtrack.recording.run_folder import Run, RunWriter
from depthtrack.recording.run_rows import RunRow, read_rows
from depthtrack.recording.status import Status

CONFIGURATION = {"tracker": "pso", "seed": 3, "hand": json.loads(HandShape().to_json()), "threads": 2}
STAGES = ("segment", "swarm")


def row(index: int, seed: int = 0) -> RunRow:
    rng = np.random.default_rng([seed, index])
    if index % 4 == 3:
        return RunRow(index, index / 30, Status.ABSENT, float("nan"), 0.0, None)
    pose = rng.normal(size=27)
    pose[ORIENTATION] /= np.linalg.norm(pose[ORIENTATION])
    return RunRow(index, index / 30, Status.TRACKED, rng.random(), rng.random(), pose)


def write(folder: Path, count: int, resume: bool = False) -> None:
    with RunWriter(folder, CONFIGURATION, STAGES, resume) as run:
        for index in range(len(run.rows), count):
            run.append(row(index), {"segment": 1.5, "swarm": 10.0 + index})


def test_a_run_reads_back_bitwise_equal(tmp_path: Path) -> None:
    write(tmp_path / "run", 9)
    run = Run.load(tmp_path / "run")
    assert run.configuration == CONFIGURATION
    assert run.index.tolist() == list(range(9))
    assert run.status[3] == "absent"
    for index in range(9):
        expected = row(index)
        assert run.timestamps[index] == expected.timestamp
        if expected.pose is None:
            assert np.isnan(run.poses[index]).all()
            assert np.isnan(run.energy[index])
        else:
            np.testing.assert_array_equal(run.poses[index], expected.pose)
            assert run.energy[index] == expected.energy
    np.testing.assert_allclose(run.stage_ms["swarm"], 10.0 + np.arange(9))


@given(kept=st.floats(0, 1), timings_kept=st.floats(0, 1))
def test_a_run_truncated_anywhere_is_readable_and_resumes_to_the_same_end(
    tmp_path_factory: pytest.TempPathFactory, kept: float, timings_kept: float
) -> None:
    whole, cut = tmp_path_factory.mktemp("whole") / "run", tmp_path_factory.mktemp("cut") / "run"
    write(whole, 8)
    write(cut, 8)
    for name, share in (("poses.csv", kept), ("timings.csv", timings_kept)):
        data = (cut / name).read_bytes()
        header = data.index(b"\n") + 1
        # Timings are written first, so at least as many of their rows are there.
        (cut / name).write_bytes(data[: header + round(share * (len(data) - header))])
    rows = read_rows(cut)
    for found in rows:
        expected = row(found.index)
        assert (found.pose is None) == (expected.pose is None)
        np.testing.assert_array_equal(found.pose, expected.pose)
    write(cut, 8, resume=True)
    assert (cut / "poses.csv").read_bytes() == (whole / "poses.csv").read_bytes()


def test_an_existing_run_is_not_overwritten(tmp_path: Path) -> None:
    write(tmp_path / "run", 2)
    with pytest.raises(InputError, match="--resume"):
        write(tmp_path / "run", 4)
    assert len(read_rows(tmp_path / "run")) == 2


def test_a_run_resumes_only_with_its_own_options(tmp_path: Path) -> None:
    write(tmp_path / "run", 2)
    with pytest.raises(InputError, match="seed = 3, not 4"):
        RunWriter(tmp_path / "run", {**CONFIGURATION, "seed": 4}, STAGES, resume=True)
    with pytest.raises(InputError, match="tracker = 'pso', not 'ik'"):
        RunWriter(tmp_path / "run", {**CONFIGURATION, "inner": 5, "tracker": "ik"}, STAGES, resume=True)
    RunWriter(tmp_path / "run", {**CONFIGURATION, "threads": 1}, STAGES, resume=True).close()


def test_what_differs_is_named_by_its_options(tmp_path: Path) -> None:
    write(tmp_path / "run", 2)
    for entry, message in {
        "hand": r"another hand \(--hand, --side\)",
        "reading": "--depth-scale",
        "options": "begun with options",
    }.items():
        with pytest.raises(InputError, match=message):
            # The backward pass differs as well, since it follows from the options.
            RunWriter(tmp_path / "run", {**CONFIGURATION, entry: "other", "backward": None, "x": 1}, STAGES, True)


@pytest.mark.parametrize("resume", [False, True])
def test_poses_without_a_configuration_are_not_replaced(tmp_path: Path, resume: bool) -> None:
    write(tmp_path, 2)
    (tmp_path / "run.json").unlink()
    with pytest.raises(InputError, match=r"poses.csv without a run.json"):
        write(tmp_path, 2, resume)
    assert len(read_rows(tmp_path)) == 2
    (tmp_path / "poses.csv").write_text((tmp_path / "poses.csv").read_text().splitlines()[0] + "\r\n")
    write(tmp_path, 3, resume)  # as if it had been killed before its first frame
    assert len(read_rows(tmp_path)) == 3


def test_a_run_goes_on_without_damaged_frames(tmp_path: Path) -> None:
    """It may not return to their refusal, which would have ended it earlier."""
    refuse, skip = ({**CONFIGURATION, "on_damage": choice} for choice in ("refuse", "skip"))
    for configuration in (refuse, skip):
        RunWriter(tmp_path / "run", configuration, STAGES, resume=True).close()
        assert Run.load(tmp_path / "run").configuration == configuration
    with pytest.raises(InputError, match="on_damage"):
        RunWriter(tmp_path / "run", refuse, STAGES, resume=True)


def test_resuming_an_empty_folder_begins_a_run(tmp_path: Path) -> None:
    write(tmp_path / "run", 3, resume=True)
    assert len(Run.load(tmp_path / "run").index) == 3


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("run.json", "{", "holds no run"),
        ("run.json", "[]", "JSON object"),
        ("poses.csv", "index\n1\n", "columns"),
        ("run.json", "[" * 100_000, "holds no run"),
        ("run.json", " " * (1 << 21), "at most 1,048,576 bytes"),
        ("poses.csv", None, "is missing"),
        ("poses.csv", "x" * 200_000 + "\n", "must be a CSV table"),
        ("timings.csv", "", "must begin with"),
        ("timings.csv", "index,swarm\n0,1\n1,x\n", "line 3: expected milliseconds"),
        ("timings.csv", "index,swarm\n0,1,2\n1,2\n", "line 2: expected 2 columns"),
    ],
)
def test_damaged_runs_are_rejected_in_one_sentence(tmp_path: Path, name: str, text: str | None, message: str) -> None:
    write(tmp_path / "run", 2)
    if text is None:
        (tmp_path / "run" / name).unlink()
    else:
        (tmp_path / "run" / name).write_text(text)
    with pytest.raises(InputError, match=message):
        Run.load(tmp_path / "run")


@pytest.mark.parametrize(
    ("found", "damaged", "message"),
    [
        ("tracked,0", "tracked,x", "line 2: expected 59 values"),
        ("tracked,0", 'tracked,"0', "line 2: expected 59 values"),
        ("tracked,0", "tracked", "line 2: expected 59 columns, found 58"),
        ("\n0,", f"\n{10**15},", "line 2: .* frames are numbered from 0 to"),
        ("\n0,", f"\n{10**30},", "line 2: .* expected a whole number"),
        ("\n0,", "\n1_0,", "line 2: .* expected a whole number"),
    ],
)
def test_a_malformed_row_is_named(tmp_path: Path, found: str, damaged: str, message: str) -> None:
    write(tmp_path / "run", 2)
    path = tmp_path / "run" / "poses.csv"
    text = path.read_text()
    assert found in text
    path.write_text(text.replace(found, damaged, 1))
    with pytest.raises(InputError, match=message):
        Run.load(tmp_path / "run")


@pytest.mark.parametrize(
    ("column", "value", "message"),
    [
        ("timestamp", "1e300", "frame 1: the timestamp must be seconds below 1e[+]12, found 1e[+]300"),
        ("timestamp", "nan", "frame 1: the timestamp must be .*, found nan"),
        ("status", "flying", "line 3: .*the status must be one of"),
        ("confidence", "1.5", "frame 1: confidence and visibility must be shares from 0 to 1, found 1.5"),
        ("ring_visible", "-1", "frame 1: confidence and visibility must be shares"),
        ("x", "1e300", "frame 1: a pose must be numbers up to 100"),
        ("x", "nan", "frame 1: a pose must be numbers"),
        ("x", "", "line 3: expected 59 values"),
        ("x", "y" * 100_000, "line 3: expected 59 values .{1,140}$"),
        ("qw", "3", "frame 1: the quaternion must have length 1, found [0-9.]{1,7}$"),
    ],
)
def test_rows_that_no_tracker_writes_are_rejected(tmp_path: Path, column: str, value: str, message: str) -> None:
    write(tmp_path / "run", 2)
    path = tmp_path / "run" / "poses.csv"
    header, first, second = path.read_text().splitlines()
    cells = second.split(",")
    cells[header.split(",").index(column)] = value
    path.write_text("\n".join((header, first, ",".join(cells), "")))
    with pytest.raises(InputError, match=message):
        Run.load(tmp_path / "run")
    with pytest.raises(InputError, match=message):
        write(tmp_path / "run", 3, resume=True)


@pytest.mark.parametrize("status", Status)
def test_every_status_can_be_read_back(tmp_path: Path, status: Status) -> None:
    with RunWriter(tmp_path / "run", CONFIGURATION, ("segment",)) as writer:
        writer.append(replace(row(0), status=status), {})
    assert Run.load(tmp_path / "run").status == (status,)


def test_a_repeated_row_is_rejected(tmp_path: Path) -> None:
    write(tmp_path, 3)
    lines = (tmp_path / "poses.csv").read_text().splitlines(keepends=True)
    (tmp_path / "poses.csv").write_text("".join([*lines[:3], *lines[2:]]))
    with pytest.raises(InputError, match="line 4: expected a frame after 1, found 1"):
        Run.load(tmp_path)


def test_a_run_before_format_3_is_read_with_its_agreement(tmp_path: Path) -> None:
    folder = tmp_path / "old"
    folder.mkdir()
    (folder / "run.json").write_text("{}")
    pose = ",".join(["0.0", "0.0", "0.5", "1.0", "0.0", "0.0", "0.0", *["0.1"] * 20])
    header = ",".join(["index", "timestamp", "status", "energy", "confidence", *POSE_NAMES])
    (folder / "poses.csv").write_text(f"{header}\n0,0.0,started,5.0,0.9,{pose}\n")
    (folder / "timings.csv").write_text("index,segment\n0,1.0\n")
    run = Run.load(folder)
    assert run.agreement.tolist() == [0.9]
    assert np.isnan(run.confidence).all()
    assert np.isnan(run.visibility).all()
    assert run.visibility.shape == (1, 5)


def test_confidence_and_visibility_are_read_back_bitwise(tmp_path: Path) -> None:
    pose = np.array([0.0, 0, 0.5, 1, 0, 0, 0, *[0.1] * 20])
    row = RunRow(0, 0.0, Status.TRACKED, 5.0, 0.9, pose, 1 / 3, (0.1, 1 / 7, 1.0, 0.0, 0.5))
    with RunWriter(tmp_path / "run", {}, ("segment",)) as run:
        run.append(row, {})
    read = Run.load(tmp_path / "run")
    assert read.confidence.tolist() == [1 / 3]
    assert tuple(read.visibility[0]) == row.visibility

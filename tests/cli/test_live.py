"""`depthtrack live` on recordings: figures, limits, interruption and errors."""

import json
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

import depthtrack.live.tracking as live_tracking
from depthtrack.cli import main
from depthtrack.live.tracking import LiveEstimate, track_live
from tests.support.runs import synthesise

FRAMES = 4
FAST = ("--tracker", "ik", "--hand", "average")


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> str:
    return str(synthesise(tmp_path_factory.mktemp("live") / "everyday", FRAMES))


def figures(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    assert main(["live", "--json", *FAST, *arguments]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def test_frame_by_frame_nothing_is_dropped(recording: str, capsys: pytest.CaptureFixture[str]) -> None:
    found = figures(capsys, "--source", recording)
    assert (found["frames"], found["dropped"], found["trusted"]) == (FRAMES, 0, FRAMES)
    assert 0 < found["latency_ms"]["median"] <= found["latency_ms"]["p95"]
    assert figures(capsys, "--source", recording, "--frames", "2", "--smooth")["frames"] == 2


def test_a_recording_plays_in_real_time(recording: str, capsys: pytest.CaptureFixture[str]) -> None:
    """How many frames are dropped depends on the machine."""
    assert main(["live", *FAST, "--source", recording, "--realtime"]) == 0
    text = capsys.readouterr().out
    assert "frames tracked" in text
    assert "(median)" in text


def test_an_interrupt_ends_the_run_with_its_figures(
    recording: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*arguments: Any, **options: Any) -> Iterator[LiveEstimate]:
        yield next(track_live(*arguments, **options))
        raise KeyboardInterrupt

    monkeypatch.setattr(live_tracking, "track_live", interrupted)
    assert figures(capsys, "--source", recording)["frames"] == 1


@pytest.mark.skipif(find_spec("rerun") is None, reason="rerun-sdk is not installed (the extra 'view')")
def test_the_viewer_s_file_is_written(recording: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = figures(capsys, "--source", recording, "--rrd", str(tmp_path / "a.rrd"))
    assert found["frames"] == FRAMES
    assert (tmp_path / "a.rrd").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--source", "{out}/nowhere"], "there is no recording at"),
        (["--source", "{recording}", "--frames", "0"], "--frames must be from 1 to 10000000, found 0"),
        (["--source", "{recording}", "--threads", "0"], "--threads must be from 1"),
        (["--source", "{recording}", "--serial", "1"], "--serial is of a camera: use --source realsense"),
        (["--source", "{recording}", "--tracker", "lift"], "needs 2D keypoints"),
        (["--source", "{recording}", "--view", "--rrd", "{out}/a.rrd"], "exclude each other"),
        (["--source", "{recording}", "--rrd", "{out}/a.txt"], "--rrd must end in .rrd"),
        (["--source", "{recording}", "--hand", "{out}/none.json"], "none.json"),
        (["--source", "{recording}", "--camera-preset", "tum", "--camera", "{out}/c.json"], "exclude each other"),
    ],
)
def test_unusable_arguments_are_rejected_in_a_sentence(
    recording: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], expected: str
) -> None:
    given = [argument.format(out=tmp_path, recording=recording) for argument in arguments]
    assert main(["live", *given]) == 2
    assert expected in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []

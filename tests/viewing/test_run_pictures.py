"""Pictures, videos, pages and viewer files of runs with known errors."""

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from depthtrack.cli import main
from depthtrack.evaluation.replay import Replay
from depthtrack.geometry.camera import Camera
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.recording.run_folder import Run
from depthtrack.recording.status import Status
from depthtrack.types import Image
from depthtrack.viewing.close_ups import close_up_regions
from depthtrack.viewing.residual_colours import LARGEST, UNCOVERED, UNREAD, residual_scale, residual_to_rgb
from depthtrack.viewing.run_pictures import LAYERS, RunPainter
from depthtrack.viewing.run_sheet import run_sheet
from depthtrack.viewing.run_video import write_run_video
from depthtrack.viewing.theme import NO_READING, STATUS_COLOURS, TEXT
from depthtrack.viewing.timeline import Timeline
from tests.support.runs import synthesise, true_poses, write_run

FRAMES = 6
STATUS = {2: "absent", 4: "lost"}
needs_rerun = pytest.mark.skipif(find_spec("rerun") is None, reason="rerun-sdk is not installed (the extra 'view')")


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return synthesise(tmp_path_factory.mktemp("made") / "everyday", FRAMES)


@pytest.fixture(scope="module")
def run(recording: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_run(tmp_path_factory.mktemp("runs") / "run", recording, true_poses(recording), STATUS)


@pytest.fixture
def out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an empty working directory, without a display."""
    monkeypatch.chdir(tmp_path)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path


def opened(run: Path) -> Replay:
    return Replay.open(Run.load(run))


def is_colour(image: Image, colour: tuple[int, int, int]) -> NDArray[np.bool_]:
    return np.asarray((image == np.array(colour)).all(axis=-1))


# Pictures


def test_pictures_of_all_frames_have_one_size_for_every_status(run: Path) -> None:
    replay = opened(run)
    painter = RunPainter(replay, height=121)
    pictures = [painter.picture(replayed) for replayed in replay]
    assert len(pictures) == FRAMES
    assert len({picture.shape for picture in pictures}) == 1
    assert painter.picture(replay.at(3)).shape == pictures[0].shape
    for replayed in replay:
        assert {painter.view(replayed, layer).shape for layer in (*LAYERS, "overlay")} == {(121, 161, 3)}
        shows_status = is_colour(painter.picture(replayed)[:34], STATUS_COLOURS[replayed.estimate.status])
        assert shows_status.any()


def test_the_hypothesis_is_drawn_only_on_its_silhouette(recording: Path, tmp_path: Path) -> None:
    with_hand = opened(write_run(tmp_path / "with", recording, true_poses(recording)))
    nothing = opened(write_run(tmp_path / "without", recording, true_poses(recording), {0: "absent"}))
    height = with_hand.sequence.camera.height
    drawn = RunPainter(with_hand, height).view(with_hand.at(0), "recording")
    plain = RunPainter(nothing, height).view(nothing.at(0), "recording")
    changed = (drawn != plain).any(axis=-1)
    silhouette = with_hand.surface().silhouette(with_hand.run.poses[0], with_hand.sequence.camera)
    assert changed[silhouette].mean() > 0.95
    assert changed[~silhouette].mean() < 0.02  # the outline of the close-up may differ


@pytest.mark.parametrize(("shift", "towards"), [(0.015, 0), (-0.015, 2)])
def test_residuals_are_red_behind_the_hand_and_blue_in_front(
    recording: Path, tmp_path: Path, shift: float, towards: int
) -> None:
    poses = true_poses(recording)
    right = opened(write_run(tmp_path / "right", recording, poses))
    wrong = opened(write_run(tmp_path / "wrong", recording, poses + np.array([0, 0, shift, *np.zeros(24)])))
    replayed, moved = next(iter(right)), next(iter(wrong))
    exact = RunPainter(right, 240).view(replayed, "residual")
    white = (exact > 225).all(axis=-1)
    assert white.sum() > 0.8 * (is_colour(exact, NO_READING) == 0).sum() - 1500  # all but the edges
    image = RunPainter(wrong, 240).view(moved, "residual").astype(int)
    tinted = image[..., towards] - image[..., 2 - towards]
    assert np.median(tinted[white]) > 80


def test_residual_colours_match_hand_computed_values() -> None:
    measured = np.array([[0.5, 0.5 - LARGEST, 0.5 + LARGEST, 0.0, 0.5, 0.5]])
    rendered = np.array([[0.5, 0.5, 0.5, 0.5, 0.0, 0.0]])
    observed = np.array([[True, True, True, True, True, False]])
    image = residual_to_rgb(measured, rendered, observed)[0]
    assert image[0].tolist() == [255, 255, 255]
    assert image[1, 0] > image[1, 2] + 100
    assert image[2, 2] > image[2, 0] + 100
    assert image[3].tolist() == list(UNREAD)
    assert image[4].tolist() == list(UNCOVERED)
    assert image[5].tolist() == list(NO_READING)


def test_close_up_regions_of_one_size_contain_the_hand() -> None:
    camera = Camera(640, 480, 525, 525, 319.5, 239.5)
    pose = np.array([0, 0, 0.6, 0, 1, 0, 0, *np.zeros(20)])
    poses = pose + np.linspace(-0.1, 0.1, 40)[:, None] * np.eye(27)[0]
    poses[7] = np.nan
    poses[20, 0] = 3.0  # an untrusted pose
    trusted = np.ones(40, dtype=np.bool_)
    trusted[[7, 20]] = False
    keypoints = HandModel(HandShape()).keypoints(poses)
    regions = close_up_regions(camera, keypoints, trusted)
    assert len({region.shape for region in regions}) == 1
    assert regions[0].width / regions[0].height == pytest.approx(640 / 480, rel=0.02)
    assert np.all(np.diff([region.left for region in regions]) >= 0)
    pixels = camera.project(keypoints)
    for row in np.flatnonzero(trusted):
        left, top, right, bottom = regions[row]
        assert np.all((pixels[row] > [left, top]) & (pixels[row] < [right, bottom]))
    assert close_up_regions(camera, keypoints, np.zeros(40, dtype=np.bool_))[5] == (0, 0, 640, 480)


def test_the_timeline_shows_the_cursor_and_lost_frames() -> None:
    energy = np.array([1.0, 2.0, np.nan, 2.0, 50.0, 1.0])
    status = tuple(map(Status, ("started", "tracked", "absent", "tracked", "lost", "tracked")))
    timeline = Timeline(energy, status, 600)
    marked = timeline.with_cursor(3)
    assert (marked[40:, 345:353] == TEXT).all(axis=-1).any(axis=1).all()
    assert np.array_equal(marked[:, :330], timeline.image[:, :330])
    red = timeline.image[-2].astype(int)
    assert red[450, 0] > red[150, 0] + 20  # the lost frame has its colour below the curve
    assert Timeline(np.full(2, np.nan), (Status.ABSENT,) * 2, 300).with_cursor(0).shape[1] == 300


# Videos and pages


def test_a_video_has_every_frame_at_the_given_speed(run: Path, out: Path) -> None:
    count = write_run_video(opened(run), out / "video.mp4", height=96, speed=0.5)
    video = cv2.VideoCapture(str(out / "video.mp4"))
    assert count == FRAMES == video.get(cv2.CAP_PROP_FRAME_COUNT)
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(15, rel=0.02)
    first = video.read()[1][..., ::-1]
    replay = opened(run)
    expected = RunPainter(replay, 96).picture(next(iter(replay)))[: first.shape[0], : first.shape[1]]
    assert np.abs(first.astype(int) - expected).mean() < 6


def test_a_failed_video_leaves_no_file(run: Path, out: Path) -> None:
    def stop(frames: object) -> list[object]:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_run_video(opened(run), out / "video.mp4", progress=stop)  # type: ignore[arg-type]
    assert list(out.iterdir()) == []


def test_a_page_shows_the_given_frames(run: Path) -> None:
    page = run_sheet(opened(run), (1, 2, 4), height=96, columns=3)
    for status in (Status.TRACKED, Status.ABSENT, Status.LOST):
        assert is_colour(page, STATUS_COLOURS[status]).any()
    assert page.shape[1] > 3 * 2 * 128


def test_a_page_has_a_legend_of_its_colours(run: Path) -> None:
    """A frame without residuals has no such colours, so they are the legend's."""
    page = run_sheet(opened(run), (0,), height=240)
    scale = residual_scale(120, 10)
    found = [
        (y, x)
        for y, x in zip(*np.nonzero(is_colour(page, tuple(scale[0, 0]))), strict=True)
        if np.array_equal(page[y : y + 10, x : x + 120], scale)
    ]
    assert len(found) == 1
    legend = page[found[0][0] : found[0][0] + 10]
    assert is_colour(legend, UNCOVERED).sum() == 100
    assert is_colour(legend, UNREAD).sum() >= 100


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["video", "{run}", "-o", "a.txt"], "must end in .mp4"),
        (["video", "{run}", "-o", "nowhere/a.mp4"], "does not exist"),
        (["video", "{run}", "-o", "a.mp4", "--height", "5"], "from 48 to 1080"),
        (["video", "{run}", "-o", "a.mp4", "--speed", "0"], "from 0.01 to 100"),
        (["video", ".", "-o", "a.mp4"], "holds no run"),
        (["video", "{run}", "-o", "a.mp4", "--sequence", "gone"], "gone"),
        (["view", "{run}", "--sheet", "a.png", "--frames", "99"], "must be frames of the run"),
        (["view", "{run}", "--strip", "a.png"], "--strip applies to recordings"),
        (["view", "{run}", "--depth-range", "1", "2"], "--depth-range applies to recordings"),
        (["view", "{run}", "--camera-preset", "tum"], "--camera-preset applies to recordings"),
    ],
)
def test_invalid_arguments_are_reported_in_one_sentence(
    run: Path, out: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], expected: str
) -> None:
    assert main([argument.format(run=run) for argument in arguments]) == 2
    message = capsys.readouterr().err
    assert expected in message
    assert message.startswith(f"depthtrack {arguments[0]}: ")
    assert list(out.iterdir()) == []


def test_a_run_without_frames_has_no_video_and_no_page(
    recording: Path, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    empty = write_run(out / "empty", recording, np.empty((0, 27)))
    for arguments in (["video", str(empty), "-o", "a.mp4"], ["view", str(empty), "--sheet", "a.png"]):
        assert main(arguments) == 2
        assert "has no frame to show" in capsys.readouterr().err
    assert [path.name for path in out.iterdir()] == ["empty"]


def test_view_of_a_run_without_a_display_writes_a_page_and_names_the_extra(
    run: Path, out: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    monkeypatch.setattr(sys, "platform", "linux")
    assert main(["view", str(run), "--count", "2"]) == 0
    assert [path.name for path in out.iterdir()] == ["run-contact-sheet.png"]
    assert main(["view", str(run), "--rrd", "a.rrd"]) == 2
    assert "pip install 'depthtrack[view]'" in capsys.readouterr().err


@needs_rerun
def test_a_viewer_file_of_a_run_has_hypothesis_residual_and_values(run: Path, out: Path) -> None:
    assert main(["view", str(run), "--rrd", "a.rrd", "--video", "b.mp4"]) == 0
    listing = subprocess.run(
        [sys.executable, "-m", "rerun_cli", "rrd", "print", "-v", "a.rrd"], capture_output=True, text=True, check=True
    ).stdout
    for entity in ("world/camera/hypothesis", "world/camera/residual", "world/hypothesis", "world/skeleton"):
        assert f"/{entity}" in listing
    for entity in ("world/true_skeleton", "run/energy", "run/agreement", "run/error_mm", "run/status"):
        assert f"/{entity}" in listing
    assert cv2.VideoCapture("b.mp4").get(cv2.CAP_PROP_FRAME_COUNT) == FRAMES

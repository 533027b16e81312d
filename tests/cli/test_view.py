"""Test videos, files of the viewer, and the command that writes them."""

import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import cv2
import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.errors import DepthtrackError, InputError, MissingExtraError
from depthtrack.recording import open_sequence
from depthtrack.viewing.annotated_frame import AnnotatedFrame, annotated_frames
from depthtrack.viewing.rerun_viewer import RerunViewer
from depthtrack.viewing.theme import ESTIMATED_MASK
from depthtrack.viewing.video import QUICK_CODECS, WEB_CODECS, WEBM_CODECS, VideoWriter
from tests.support.recordings import CAMERA, TIMES, write_sample

needs_rerun = pytest.mark.skipif(find_spec("rerun") is None, reason="rerun-sdk is not installed (the extra 'view')")


@pytest.fixture
def sample(tmp_path: Path) -> Path:
    return write_sample(tmp_path / "sample")


@pytest.fixture
def out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an empty current folder, on a machine without a screen."""
    folder = tmp_path / "out"
    folder.mkdir()
    monkeypatch.chdir(folder)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    return folder


@pytest.fixture
def without_rerun(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


# Videos


def test_a_video_contains_all_images_in_order_and_size(out: Path) -> None:
    greys = [20, 90, 160, 230]
    with VideoWriter(out / "film.mp4", rate=12.5) as writer:
        for grey in greys:
            writer.write(np.full((49, 65, 3), (grey, 0, 0), dtype=np.uint8))
    video = cv2.VideoCapture(str(out / "film.mp4"))
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(12.5)
    for grey in greys:
        readable, image = video.read()
        assert readable
        assert image.shape == (48, 64, 3)
        # OpenCV returns blue, green, red: the written red comes last.
        assert np.abs(image.mean(axis=(0, 1)) - [0, 0, grey]).max() < 8
    assert not video.read()[0]
    assert names(out) == ["film.mp4"]


@pytest.mark.parametrize(
    ("name", "codecs"), [("film.mp4", QUICK_CODECS), ("film.mp4", WEB_CODECS), ("film.webm", WEBM_CODECS)]
)
def test_all_codecs_encode_a_video(out: Path, name: str, codecs: tuple[str, ...]) -> None:
    image = np.zeros((48, 64, 3), dtype=np.uint8)
    image[:, 32:] = (30, 200, 90)
    with VideoWriter(out / name, 30, codecs) as writer:
        writer.write(image)
    found = cv2.VideoCapture(str(out / name)).read()[1]
    assert np.abs(found[:, 40:].astype(int) - (90, 200, 30)).mean() < 10
    assert found[:, :24].mean() < 10


def test_a_failed_video_keeps_the_existing_file(out: Path) -> None:
    (out / "film.mp4").write_bytes(b"the old video")

    def write(*heights: int) -> None:
        with VideoWriter(out / "film.mp4", rate=30) as writer:
            for height in heights:
                writer.write(np.zeros((height, 64, 3), dtype=np.uint8))

    with pytest.raises(InputError, match="shape"):
        write(48, 50)
    with pytest.raises(ValueError, match="negative"):
        write(48, -1)
    write()
    assert names(out) == ["film.mp4"]
    assert (out / "film.mp4").read_bytes() == b"the old video"


def test_a_codec_that_opencv_lacks_is_reported(out: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with (
        pytest.raises(InputError, match="can encode none of zzzz"),
        VideoWriter(out / "film.mp4", 30, codecs=("zzzz",)) as writer,
    ):
        writer.write(np.zeros((48, 64, 3), dtype=np.uint8))
    assert names(out) == []


@pytest.mark.parametrize(("name", "rate"), [("film.avi", 30.0), ("nowhere/film.mp4", 30.0), ("film.mp4", 0.0)])
def test_invalid_names_and_rates_are_rejected_before_the_first_image(out: Path, name: str, rate: float) -> None:
    with pytest.raises(InputError), VideoWriter(out / name, rate):
        pass


# The command


def test_one_command_writes_sheet_strip_and_video(sample: Path, out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--sheet", "a.png", "--strip", "b.png", "--video", "c.mp4", "--count", "3"]
    assert main(["view", str(sample), *options]) == 0
    assert names(out) == ["a.png", "b.png", "c.mp4"]
    printed = capsys.readouterr().out
    assert all(name in printed for name in names(out))
    video = cv2.VideoCapture("c.mp4")
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) == len(TIMES)
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(1 / 0.0335, rel=0.03)


def test_without_the_extra_a_contact_sheet_and_the_install_command(
    sample: Path, out: Path, without_rerun: None, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["view", str(sample)]) == 0
    assert names(out) == ["sample-contact-sheet.png"]
    printed = capsys.readouterr().out
    assert "sample-contact-sheet.png" in printed
    assert "pip install 'depthtrack[view]'" in printed


@needs_rerun
def test_without_a_screen_a_contact_sheet_and_the_other_options(
    sample: Path, out: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    assert main(["view", str(sample)]) == 0
    assert names(out) == ["sample-contact-sheet.png"]
    assert "--web" in capsys.readouterr().out


def test_a_viewer_file_without_the_extra_prints_the_install_command(
    sample: Path, out: Path, without_rerun: None, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["view", str(sample), "--rrd", "a.rrd"]) == 2
    assert "pip install 'depthtrack[view]'" in capsys.readouterr().err
    assert names(out) == []
    with pytest.raises(MissingExtraError):
        RerunViewer("name", CAMERA, 0.4, 0.9)


@pytest.mark.parametrize(
    "options",
    [
        ["--frames", "5", "--sheet", "a.png"],
        ["--frames", "-1", "--strip", "a.png"],
        ["--count", "0"],
        ["--count", "1000000000"],
        ["--depth-range", "2", "1"],
        ["--depth-range", "nan", "1"],
        ["--sheet", "a.txt"],
        ["--video", "a.avi"],
        ["--sheet", "nowhere/a.png"],
    ],
)
def test_invalid_options_are_rejected_in_one_sentence(
    sample: Path, out: Path, options: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["view", str(sample), *options]) == 2
    assert capsys.readouterr().err.startswith("depthtrack view: ")
    assert names(out) == []


def test_damaged_frames_are_rejected_or_skipped_and_printed(
    sample: Path, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    damaged = sample / "depth" / "0.067000.png"
    damaged.write_bytes(damaged.read_bytes()[:40])
    assert main(["view", str(sample), "--video", "a.mp4"]) == 2
    assert names(out) == []
    assert main(["view", str(sample), "--video", "a.mp4", "--on-damage", "skip"]) == 0
    assert cv2.VideoCapture("a.mp4").get(cv2.CAP_PROP_FRAME_COUNT) == len(TIMES) - 1
    assert "skipped frame 2" in capsys.readouterr().out


# Files of the viewer


@needs_rerun
def test_a_viewer_file_contains_all_entities(sample: Path, out: Path) -> None:
    assert main(["view", str(sample), "--rrd", "a.rrd"]) == 0
    assert names(out) == ["a.rrd"]
    listing = subprocess.run(
        [sys.executable, "-m", "rerun_cli", "rrd", "print", "-v", "a.rrd"], capture_output=True, text=True, check=True
    ).stdout
    for entity in ("camera", "camera/depth", "camera/colour", "camera/mask", "camera/skeleton", "hand", "skeleton"):
        assert f"/world/{entity}" in listing


@needs_rerun
def test_a_failed_viewer_file_leaves_nothing(sample: Path, out: Path) -> None:
    def broken() -> Iterator[AnnotatedFrame]:
        yield next(annotated_frames(open_sequence(sample)))
        raise InputError("the disk is on fire")

    with pytest.raises(DepthtrackError, match="on fire"):
        RerunViewer("sample", CAMERA, 0.4, 0.9).save(out / "a.rrd", broken())
    for name in ("a.txt", "nowhere/a.rrd"):
        with pytest.raises(InputError):
            RerunViewer("sample", CAMERA, 0.4, 0.9).save(out / name, iter(()))
    assert names(out) == []


# Estimated masks


def test_a_hand_without_true_mask_is_segmented_by_default(real_data: Path, out: Path) -> None:
    recording = str(real_data / "rgbd" / "sr305-poses")
    assert main(["view", recording, "--sheet", "with.png", "--count", "3"]) == 0
    assert main(["view", recording, "--sheet", "without.png", "--count", "3", "--no-estimate"]) == 0
    for name, expected in (("with.png", True), ("without.png", False)):
        page = cv2.imread(name)
        assert page is not None
        tiles = page[:-60, :, ::-1].astype(int)  # RGB, without the legend
        marked = np.all(np.abs(tiles - ESTIMATED_MASK) < 40, axis=-1)
        assert bool(marked.sum() > 100) == expected

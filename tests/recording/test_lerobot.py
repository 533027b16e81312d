"""Depth of LeRobot: videos of quantised depth and folders of TIFF images."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from depthtrack.cli import main
from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.recording import image_size, open_sequence
from tests.support import lerobot
from tests.support.recordings import CAMERA, depth_at

pytest.importorskip("av", reason="needs the extra: pip install 'depthtrack[video]'")

FRAMES = 11
DEPTHS = [depth_at(k) for k in range(FRAMES)]
VIDEO = Path("videos") / lerobot.KEY / "chunk-000" / "file-000.mp4"


def step(depth: float) -> float:
    """Metres between two codes at a depth."""
    return float((depth + 3.5) * np.log(13.5 / 3.51) / 4095)


def sample(root: Path, video: Path = VIDEO, info: dict[str, Any] | None = None) -> Path:
    lerobot.write_info(root, info)
    lerobot.write_video(root / video, [lerobot.codes_of(depth) for depth in DEPTHS])
    return root


@pytest.mark.parametrize("version", [VIDEO, Path("videos") / "chunk-000" / lerobot.KEY / "episode_000000.mp4"])
def test_a_video_returns_the_depth_within_half_a_code(version: Path, tmp_path: Path) -> None:
    root = sample(tmp_path / "set", version)
    for path in (root, root / version):
        recording = open_sequence(path, CAMERA)
        assert len(recording) == FRAMES
        assert image_size(path) == (32, 24)
        np.testing.assert_allclose(recording.timestamps, np.arange(FRAMES) / 30, atol=1e-4)
        for index in (7, 2, 3, 0, 10, 9, 4):
            depth = recording[index].depth
            np.testing.assert_allclose(depth, DEPTHS[index], atol=step(1.0) / 2 + 1e-6)
            assert (depth[:6, :8] == 0).all()
        assert [frame.index for frame in recording] == list(range(FRAMES))


def test_linear_codes_and_raw_millimetres(tmp_path: Path) -> None:
    root = lerobot.write_info(tmp_path / "linear", {"video.use_log": False})
    lerobot.write_video(root / VIDEO, [lerobot.codes_of(depth, use_log=False) for depth in DEPTHS])
    np.testing.assert_allclose(open_sequence(root, CAMERA)[5].depth, DEPTHS[5], atol=9.99 / 4095 / 2 + 1e-6)
    names = dict.fromkeys(lerobot.QUANTISATION)
    root = lerobot.write_info(tmp_path / "raw", names)
    frames = [np.rint(1000 * depth).astype(np.uint16) for depth in DEPTHS]
    lerobot.write_video(root / VIDEO, frames, "ffv1", "gray16le", options={}, container_format="matroska")
    np.testing.assert_allclose(open_sequence(root, CAMERA)[5].depth, DEPTHS[5], atol=0.00051)


@pytest.mark.parametrize("kind", ["uint16", "float32"])
def test_tiff_images_are_millimetres_or_metres(kind: str, tmp_path: Path) -> None:
    root = lerobot.write_info(tmp_path / "set", rate=15)
    stored = [np.rint(1000 * d).astype(np.uint16) if kind == "uint16" else d for d in DEPTHS]
    folder = lerobot.write_tiffs(root / "images" / lerobot.KEY / "episode-000000", stored)
    for path in (root, folder):
        recording = open_sequence(path, CAMERA)
        assert image_size(path) == (32, 24)
        np.testing.assert_allclose(recording.timestamps, np.arange(FRAMES) / 15)
        np.testing.assert_allclose(recording[4].depth, DEPTHS[4], atol=0.00051 if kind == "uint16" else 0)


def test_a_tiff_of_another_type_or_damaged_is_refused(tmp_path: Path) -> None:
    root = lerobot.write_info(tmp_path / "set")
    folder = lerobot.write_tiffs(root / "images" / lerobot.KEY / "episode-000000", DEPTHS)
    Image.fromarray(np.zeros((24, 32, 3), dtype=np.uint8)).save(folder / "frame-000001.tiff")
    Image.fromarray(np.zeros((24, 31), dtype=np.uint16)).save(folder / "frame-000002.tiff")
    (folder / "frame-000003.tiff").write_bytes((folder / "frame-000004.tiff").read_bytes()[:300])
    recording = open_sequence(folder, CAMERA)
    for index, expected in ((1, "colours"), (2, "32x24 pixels, found 31x24"), (3, "is damaged")):
        with pytest.raises(DamagedFrameError, match=expected):
            recording[index]


def test_a_cut_video_plays_to_the_cut_and_says_so(tmp_path: Path) -> None:
    root = lerobot.write_info(tmp_path / "set")
    noise = np.random.default_rng(0).integers(1, 4096, (FRAMES, 24, 32)).astype(np.uint16)
    path = lerobot.write_video(root / VIDEO, list(noise), container={"movflags": "faststart"})
    path.write_bytes(path.read_bytes()[: -path.stat().st_size // 2])
    recording = open_sequence(path, CAMERA)
    assert 1 < len(recording) < FRAMES
    assert [frame.index for frame in recording] == list(range(len(recording)))
    assert any("cut short" in note for note in recording.notes)
    path.write_bytes(path.read_bytes()[:40])
    with pytest.raises(InputError, match=r"file-000\.mp4"):
        open_sequence(path, CAMERA)


def test_text_of_another_encoding_is_ignored_and_an_unknown_codec_is_refused(tmp_path: Path) -> None:
    path = sample(tmp_path / "set") / VIDEO
    data = path.read_bytes()
    path.write_bytes(data.replace(b"Lavf", b"La\xff\xfe"))
    np.testing.assert_allclose(open_sequence(path, CAMERA)[3].depth, DEPTHS[3], atol=step(1.0))
    path.write_bytes(data.replace(b"hev1", b"zzzz"))
    with pytest.raises(InputError, match=r"file-000\.mp4"):
        open_sequence(path, CAMERA)


def test_depth_as_colours_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    root = lerobot.write_info(tmp_path / "set")
    grey = [np.full((24, 32), k, dtype=np.uint16) for k in range(3)]
    lerobot.write_video(root / VIDEO, grey, "mpeg4", "yuv420p", options={})
    assert main(["info", str(root), "--fx", "30", "--depth-scale", "0.001"]) == 2
    assert "has lost its meaning" in capsys.readouterr().err
    info = json.loads((root / "meta" / "info.json").read_text())
    info["features"][lerobot.KEY]["info"]["is_depth_map"] = False
    (root / "meta" / "info.json").write_text(json.dumps(info))
    with pytest.raises(InputError, match=f"{lerobot.KEY} is stored as colour"):
        open_sequence(root, CAMERA)


def test_the_depth_must_be_named_if_there_are_several(tmp_path: Path) -> None:
    root = sample(tmp_path / "set")
    lerobot.write_video(root / VIDEO.with_name("file-001.mp4"), [lerobot.codes_of(DEPTHS[0])] * 2)
    with pytest.raises(InputError, match="holds 2 depth videos"):
        open_sequence(root, CAMERA)
    assert len(open_sequence(root / VIDEO.with_name("file-001.mp4"), CAMERA)) == 2
    grey = [np.full((24, 32), 9, dtype=np.uint16)] * 3
    path = root / "videos" / "observation.images.front" / "file.mp4"
    colour = lerobot.write_video(path, grey, "mpeg4", "yuv420p", options={})
    with pytest.raises(InputError, match="is no depth by"):
        open_sequence(colour, CAMERA)


@pytest.mark.parametrize(
    "info",
    [
        {"video.depth_min": None},
        {"video.depth_min": 11.0},
        {"video.shift": -0.02},
        {"video.shift": "a"},
        {"video.use_log": None},
        {"video.depth_max": True},
    ],
)
def test_a_malformed_quantisation_is_one_sentence(info: dict[str, Any], tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"info\.json must state video\.depth_min"):
        open_sequence(sample(tmp_path / "set", info=info), CAMERA)


def test_a_camera_is_needed_and_its_size_must_fit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    root = sample(tmp_path / "set")
    with pytest.raises(InputError, match="stores no camera"):
        open_sequence(root)
    assert main(["info", str(root), "--fx", "30", "--depth-scale", "0.001"]) == 0
    assert "LeRobot" in capsys.readouterr().out
    assert main(["info", str(root), "--camera-preset", "kinect1"]) == 2
    assert "640x480 pixels, found 32x24" in capsys.readouterr().err

"""A new format is one small class with the defaults of BaseSequence."""

from pathlib import Path

import numpy as np
import pytest

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.geometry.camera import Camera
from depthtrack.recording import Sequence, open_sequence, registry
from depthtrack.recording.reading import ReadingOptions
from depthtrack.recording.sequences.base import BaseSequence
from depthtrack.recording.sequences.capture import CaptureSequence
from depthtrack.recording.sequences.tum import TumSequence
from depthtrack.types import Depth, Image

CAMERA = Camera(4, 3, 4.0, 4.0, 1.5, 1.0)


class ArraySequence(BaseSequence):
    """A format of depth images (N, h, w) in a .npy file; a negative value damages its frame."""

    format_name = "a .npy file"

    def _open(self, camera: Camera | None) -> None:
        self._depth = np.load(self.path, allow_pickle=False)
        self.camera, self.has_colour = camera or CAMERA, True
        self.timestamps = np.arange(len(self._depth)) / 30

    @classmethod
    def matches(cls, path: Path) -> bool:
        return path.suffix == ".npy"

    @classmethod
    def image_size(cls, path: Path, reading: ReadingOptions | None = None) -> tuple[int, int]:
        return CAMERA.width, CAMERA.height

    def read_colour(self, index: int) -> Image:
        return np.full((*CAMERA.shape, 3), index, dtype=np.uint8)

    def read_depth(self, index: int) -> Depth:
        depth: Depth = self._depth[index].astype(np.float32)
        if depth.min() < 0:
            raise DamagedFrameError("depth is negative")
        return depth


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(registry, "formats", lambda: (TumSequence, ArraySequence))
    np.save(tmp_path / "film.npy", np.array([0.5, -1.0, 0.7])[:, None, None] * np.ones(CAMERA.shape))
    return tmp_path / "film.npy"


def test_a_new_format_has_the_defaults_of_the_base(path: Path) -> None:
    sequence: Sequence = open_sequence(path, on_damage="skip")
    assert (sequence.name, len(sequence), sequence.camera) == ("film.npy", 3, CAMERA)
    assert registry.image_size(path) == (4, 3)
    assert sequence.hand is None
    assert sequence.ground_truth is None
    assert sequence.description == {}
    assert sequence.notes == []
    assert sequence.hand_mask(0) is None
    assert sequence.exact_depth(0) is None
    assert sequence[-1].timestamp == pytest.approx(2 / 30)


def test_colour_is_ignored_on_demand_in_every_format(path: Path) -> None:
    sequence = open_sequence(path)
    assert sequence.has_colour
    assert sequence[0].colour is not None
    alone = open_sequence(path, reading=ReadingOptions(depth_only=True))
    assert not alone.has_colour
    assert alone[0].colour is None


def test_damaged_frames_of_a_new_format_are_skipped_or_rejected(path: Path) -> None:
    sequence = open_sequence(path, on_damage="skip")
    assert [(frame.index, frame.depth.mean()) for frame in sequence] == [(0, 0.5), (2, np.float32(0.7))]
    assert [(frame.index, frame.reason) for frame in sequence.damaged] == [(1, "depth is negative")]
    with pytest.raises(DamagedFrameError, match=r"frame 1: depth is negative .*--on-damage skip"):
        list(open_sequence(path))


def test_the_error_of_an_unknown_format_names_the_known_ones(path: Path) -> None:
    with pytest.raises(InputError, match=r"must be a folder with depth\.txt \([\w -]+\), found another format"):
        open_sequence(path.parent)
    (path.parent / "notes.txt").write_text("none")
    with pytest.raises(InputError, match=r"must be a \.npy file, found another format"):
        open_sequence(path.parent / "notes.txt")


def test_formats_are_found_by_their_modules() -> None:
    found = registry.formats()
    assert {TumSequence, CaptureSequence} <= set(found)
    assert len(found) == len(set(found))
    assert [each.is_generic for each in found] == sorted(each.is_generic for each in found)


@pytest.mark.parametrize("name", ["film.svo2", "film.SVO"])
def test_files_of_closed_formats_are_rejected_with_advice(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"anything")
    with pytest.raises(InputError, match="library of its maker"):
        open_sequence(tmp_path / name)

"""Reading of TUM folders: association, streaming, damage, and real recordings."""

import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.geometry.camera import Camera
from depthtrack.recording import GroundTruth, SequenceWriter, image_size, open_sequence
from depthtrack.recording.colour_association import associate
from depthtrack.recording.sequence import OnDamage, Sequence
from tests.support.recordings import CAMERA, TIMES, colour_at, depth_at, write_plain_tum, write_sample

TUM_CAMERA = Camera(CAMERA.width, CAMERA.height, 30.0, 30.0, 15.5, 11.5, 1 / 5000)
milliseconds = st.lists(st.integers(0, 400), unique=True, max_size=40).map(sorted)


def all_pairs_association(depth: list[int], colour: list[int], max_difference: int) -> dict[int, int]:
    """Return the association by comparison of all pairs; the earlier of two equally near wins."""
    nearest = {i: min(range(len(colour)), key=lambda j: abs(colour[j] - t)) for i, t in enumerate(depth) if colour}
    return {i: j for i, j in nearest.items() if abs(colour[j] - depth[i]) < max_difference}


@given(depth=milliseconds, colour=milliseconds, max_difference=st.integers(1, 60))
def test_association_is_that_of_all_pairs(depth: list[int], colour: list[int], max_difference: int) -> None:
    assert associate(depth, colour, max_difference) == all_pairs_association(depth, colour, max_difference)


def test_a_plain_tum_folder_opens_with_a_camera_given(tmp_path: Path) -> None:
    path = write_plain_tum(tmp_path / "tum")
    assert image_size(path) == (CAMERA.width, CAMERA.height)
    sequence = open_sequence(path, TUM_CAMERA)
    assert sequence.ground_truth is None
    assert sequence.hand_mask(0) is None
    assert sequence.exact_depth(0) is None
    for index, frame in enumerate(sequence):
        assert frame.timestamp == TIMES[index]
        np.testing.assert_allclose(frame.depth, depth_at(index), atol=0.0001 + 1e-7)
        np.testing.assert_array_equal(frame.colour, colour_at(index))


def test_without_a_camera_the_error_names_the_options(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no camera\.json.*--camera-preset"):
        open_sequence(write_plain_tum(tmp_path / "tum"))


def test_a_camera_given_replaces_that_of_the_folder(tmp_path: Path) -> None:
    path = write_sample(tmp_path / "sample")
    np.testing.assert_allclose(open_sequence(path, TUM_CAMERA)[1].depth, 0.2 * open_sequence(path)[1].depth, rtol=1e-6)


def test_a_depth_image_without_a_colour_image_in_time_has_none(tmp_path: Path) -> None:
    path = write_plain_tum(tmp_path / "tum")
    lines = (path / "rgb.txt").read_text().splitlines()
    (path / "rgb.txt").write_text("\n".join([*lines[:2], *lines[3:]]))
    coloured = [frame.colour is not None for frame in open_sequence(path, TUM_CAMERA)]
    assert coloured == [True, False, True, True, True]


def test_indexing_works_like_a_lists(tmp_path: Path) -> None:
    sequence = open_sequence(write_sample(tmp_path / "sample"))
    assert sequence[-1].index == len(sequence) - 1 == 4
    assert [frame.index for frame in sequence.frames([3, 1])] == [3, 1]
    assert list(sequence.frames([])) == []
    with pytest.raises(IndexError):
        sequence[5]


def test_memory_does_not_grow_with_length(tmp_path: Path) -> None:
    camera = Camera(160, 120, 150.0, 150.0, 80.0, 60.0)
    with SequenceWriter(tmp_path / "long", camera) as out:
        for index in range(60):
            out.append(index / 30, np.full(camera.shape, 0.5), colour=np.zeros((*camera.shape, 3), np.uint8))
    sequence = open_sequence(tmp_path / "long")
    one_frame = sequence[0].depth.nbytes
    # The least of several peaks: other threads of the process allocate too.
    assert min(_peak_of_iteration(sequence, 60) for _ in range(5)) < 6 * one_frame


def _peak_of_iteration(sequence: Sequence, length: int) -> int:
    """Return the most bytes that were allocated at once while all frames were read."""
    tracemalloc.start()
    try:
        assert sum(1 for _ in sequence) == length
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@given(milliseconds, st.integers(-20, 420), st.integers(0, 30))
def test_the_nearest_annotation_within_the_tolerance_is_found(times: list[int], wanted: int, tolerance: int) -> None:
    row = GroundTruth(np.array(times, dtype=float)).at(wanted, tolerance)
    distances = [abs(time - wanted) for time in times]
    if row is None:
        assert min(distances, default=np.inf) > tolerance
    else:
        assert distances[row] == min(distances) <= tolerance


def test_a_path_without_a_recording_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file or folder"):
        open_sequence(tmp_path / "nowhere")
    with pytest.raises(InputError, match=r"must be .*a folder with depth\.txt"):
        open_sequence(tmp_path)


# Damage: one frame cannot be read, the rest can.


def rewrite(image: NDArray[np.uint8] | NDArray[np.uint16], suffix: str = ".png") -> Callable[[Path], object]:
    return lambda path: path.write_bytes(cv2.imencode(suffix, image)[1].tobytes())


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-40])


def flip_a_bit(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 4
    path.write_bytes(data)


def claim_a_huge_size(path: Path) -> None:
    """Write 65536 x 65536 into the header of a PNG, with a valid checksum."""
    data = path.read_bytes()
    header = b"IHDR" + b"\x00\x01\x00\x00" * 2 + data[24:29]
    path.write_bytes(data[:12] + header + zlib.crc32(header).to_bytes(4, "big") + data[33:])


def become_a_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


DAMAGES: dict[str, tuple[Callable[[Path], object], str]] = {
    "missing": (Path.unlink, "is missing"),
    "a folder": (become_a_folder, "is missing"),
    "empty": (lambda path: path.write_bytes(b""), "found 0 bytes"),
    "no image": (lambda path: path.write_bytes(b"GIF89a"), "found 6 bytes that begin with b'GIF8'"),
    "only a signature": (lambda path: path.write_bytes(path.read_bytes()[:20]), "is damaged: Truncated File Read"),
    "truncated": (truncate, "is damaged"),
    "a flipped bit": (flip_a_bit, "is damaged: broken PNG file"),
    "8 bits": (rewrite(np.zeros(CAMERA.shape, np.uint8)), "16-bit PNG with one channel, found a PNG of mode L"),
    "three channels": (rewrite(np.zeros((*CAMERA.shape, 3), np.uint16)), "found a PNG of mode RGB"),
    "a JPEG": (rewrite(np.zeros(CAMERA.shape, np.uint8), ".jpg"), "must be a 16-bit PNG .*, found a JPEG"),
    "wrong size": (rewrite(np.zeros((5, 7), np.uint16)), "must have the camera's 32x24 pixels, found 7x5"),
    "absurd size": (claim_a_huge_size, "exceeds limit"),
    "too long": (lambda path: path.write_bytes(path.read_bytes() + b"\0" * (1 << 21)), "must be at most .* bytes long"),
}


@pytest.fixture
def sample(tmp_path: Path) -> Path:
    return write_sample(tmp_path / "sample")


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_frame_is_rejected_or_skipped_and_counted(sample: Path, damage: str) -> None:
    inflict, message = DAMAGES[damage]
    inflict(sorted((sample / "depth").iterdir())[2])

    with pytest.raises(DamagedFrameError, match=rf"frame 2: .*({message}).*--on-damage skip"):
        list(open_sequence(sample, on_damage="refuse"))

    sequence = open_sequence(sample, on_damage="skip")
    assert len(sequence) == 5
    for _ in range(2):
        assert [frame.index for frame in sequence] == [0, 1, 3, 4]
    assert [(frame.index, frame.timestamp) for frame in sequence.damaged] == [(2, TIMES[2])]
    assert sequence.damaged[0].reason.startswith(str(sample / "depth"))
    with pytest.raises(DamagedFrameError, match=message):
        sequence[2]


@pytest.mark.parametrize("on_damage", ["refuse", "skip"])
def test_a_damaged_colour_image_costs_only_the_colour_of_its_frame(sample: Path, on_damage: OnDamage) -> None:
    truncate(sorted((sample / "rgb").iterdir())[1])
    sequence = open_sequence(sample, on_damage=on_damage)
    assert [frame.colour is not None for frame in sequence] == [True, False, True, True, True]
    assert sequence.damaged == []
    assert [frame.index for frame in sequence.damaged_colour] == [1]
    assert "is truncated" in sequence.damaged_colour[0].reason


def test_a_damaged_mask_damages_only_itself(sample: Path) -> None:
    truncate(sorted((sample / "hand_mask").iterdir())[1])
    sequence = open_sequence(sample)
    assert len(list(sequence)) == 5
    with pytest.raises(DamagedFrameError, match="is damaged"):
        sequence.hand_mask(1)


def test_a_recording_without_any_readable_frame_is_an_error(sample: Path) -> None:
    for path in (sample / "depth").iterdir():
        path.unlink()
    with pytest.raises(InputError, match="no frame can be read"):
        list(open_sequence(sample, on_damage="skip"))


@pytest.mark.parametrize("suffix", ["png", "jpg"])
def test_a_header_of_another_size_never_reaches_the_decoder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    with SequenceWriter(tmp_path / "out", CAMERA, colour_format=suffix) as out:  # type: ignore[arg-type]
        out.append(0.0, depth_at(0), colour=colour_at(0))
    path = tmp_path / "out" / "rgb" / f"0.000000.{suffix}"
    data = path.read_bytes()
    height, width = CAMERA.height.to_bytes(2, "big"), CAMERA.width.to_bytes(2, "big")
    if suffix == "png":
        claim_a_huge_size(path)
    else:
        path.write_bytes(data.replace(height + width, b"\xff\xff\xff\xff", 1))
    monkeypatch.setattr(cv2, "imdecode", lambda *_: pytest.fail("the decoder was asked"))
    monkeypatch.setattr("depthtrack.recording.sequences.tum.read_depth", lambda *_: np.zeros(CAMERA.shape, np.uint16))
    sequence = open_sequence(tmp_path / "out")
    assert sequence[0].colour is None
    assert "exceeds limit" in sequence.damaged_colour[0].reason


@given(st.data())
def test_every_truncation_is_detected(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    folder = write_sample(tmp_path_factory.mktemp("cut") / "sample")
    path = data.draw(st.sampled_from([folder / "depth/0.000000.png", folder / "rgb/0.000000.jpg"]))
    whole = path.read_bytes()
    path.write_bytes(whole[: data.draw(st.integers(0, len(whole) - 1))])
    sequence = open_sequence(folder)
    if path.suffix == ".png":
        with pytest.raises(DamagedFrameError):
            sequence[0]
    else:
        assert sequence[0].colour is None
        assert len(sequence.damaged_colour) == 1


@given(st.data())
def test_every_changed_byte_of_a_depth_image_is_detected(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    folder = write_sample(tmp_path_factory.mktemp("flip") / "sample")
    path = folder / "depth/0.000000.png"
    whole = bytearray(path.read_bytes())
    whole[data.draw(st.integers(0, len(whole) - 1))] ^= data.draw(st.integers(1, 255))
    path.write_bytes(whole)
    with pytest.raises(DamagedFrameError):
        open_sequence(folder)[0]


# Real recordings.


def test_the_annotated_real_recording_is_consistent(real_data: Path) -> None:
    sequence = open_sequence(real_data / "rgbd" / "open-close")
    truth = sequence.ground_truth
    assert truth is not None
    assert truth.joints is not None
    inside = []
    for frame in sequence:
        mask, row = sequence.hand_mask(frame.index), truth.at(frame.timestamp)
        assert frame.colour is not None
        assert mask is not None
        assert row is not None
        columns, rows = np.round(frame.camera.project(truth.joints[row])).astype(int).T
        grown = cv2.dilate(mask.astype(np.uint8), np.ones((9, 9), np.uint8))
        inside.append(grown[rows, columns].mean())
        # Skin is redder than blue: the channels are in order.
        assert frame.colour[mask][:, 0].mean() > frame.colour[mask][:, 2].mean()
        # The hand's surface is where its joints are, give or take its thickness.
        distance = np.median(frame.depth[mask & (frame.depth > 0)]) - np.median(truth.joints[row][:, 2])
        assert abs(distance) < 0.03
    assert len(inside) == 35
    assert np.mean(inside) > 0.9


@pytest.mark.parametrize(
    ("name", "frames", "coloured"),
    [("kinect2-counting", 200, False), ("sr305-poses", 19, False), ("with-ball", 150, True)],
)
def test_the_other_real_recordings_open(real_data: Path, name: str, frames: int, coloured: bool) -> None:
    sequence = open_sequence(real_data / "rgbd" / name)
    assert len(sequence) == frames
    for frame in sequence.frames(range(0, frames, 19)):
        assert frame.depth.shape == sequence.camera.shape
        assert 0.05 < np.median(frame.depth[frame.depth > 0]) < 4
        assert (frame.colour is not None) == coloured

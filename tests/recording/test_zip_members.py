"""Zip files are read with bounds, and up to their end if they are cut."""

import io
import re
import struct
import zipfile
from pathlib import Path

import pytest

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.recording.zip_members import ZipMembers

CONTENT = {f"rgbd/{k}.depth": bytes([k]) * (500 + k) for k in (0, 2, 10)}


def written(method: int, streamed: bool) -> bytes:
    """A zip file; a streamed one has sizes behind its members instead of before them."""
    data = io.BytesIO()
    if streamed:
        data.seekable = lambda: False  # type: ignore[method-assign]
    with zipfile.ZipFile(data, "w", method) as archive:
        for name, content in CONTENT.items():
            archive.writestr(name, content)
    return data.getvalue()


@pytest.mark.parametrize("method", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
@pytest.mark.parametrize("streamed", [False, True])
def test_members_are_those_written_and_a_cut_file_ends_earlier(method: int, streamed: bool, tmp_path: Path) -> None:
    data, path = written(method, streamed), tmp_path / "a.zip"
    path.write_bytes(data)
    members = ZipMembers.of(path)
    assert not members.truncated
    assert {name: members.read(name, 1000) for name in members.members} == CONTENT
    assert members.numbered(re.compile(r"rgbd/(\d+)\.depth")) == {
        0: "rgbd/0.depth",
        2: "rgbd/2.depth",
        10: "rgbd/10.depth",
    }
    counts = []
    for end in range(60, len(data) - 22, 7):
        path.write_bytes(data[:end])
        try:
            cut = ZipMembers.of(path)
        except InputError:
            counts.append(0)
            continue
        assert cut.truncated
        assert {name: cut.read(name, 1000) for name in cut.members}.items() <= CONTENT.items()
        counts.append(len(cut.members))
    assert counts == sorted(counts)
    assert counts[-1] == 3


def test_sizes_are_bounded_by_what_is_declared_and_by_what_is_found(tmp_path: Path) -> None:
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("zeros", bytes(50_000_000))
    with pytest.raises(DamagedFrameError, match="at most 1,000,000 bytes"):
        ZipMembers.of(path).read("zeros", 1_000_000)
    data = path.read_bytes().replace(struct.pack("<I", 50_000_000), struct.pack("<I", 1000))
    path.write_bytes(data)
    with pytest.raises(DamagedFrameError, match="checksum or its size"):
        ZipMembers.of(path).read("zeros", 1_000_000)


def test_damage_is_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "a.zip"
    data = written(zipfile.ZIP_STORED, streamed=False)
    path.write_bytes(data.replace(bytes([2]) * 502, bytes([2]) * 501 + b"x"))
    members = ZipMembers.of(path)
    with pytest.raises(DamagedFrameError, match="checksum"):
        members.read("rgbd/2.depth", 1000)
    assert members.read("rgbd/0.depth", 1000) == CONTENT["rgbd/0.depth"]
    with pytest.raises(DamagedFrameError, match="is missing"):
        members.read("rgbd/3.depth", 1000)
    for content in (b"", b"PK\3\4", b"no zip file"):
        path.write_bytes(content)
        with pytest.raises(InputError, match="must be a zip file"):
            ZipMembers.of(path)
    with pytest.raises(InputError, match="cannot read"):
        ZipMembers.of(tmp_path / "gone")

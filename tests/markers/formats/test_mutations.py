"""Damage files of every format at random: each is read, or refused in one sentence."""

from pathlib import Path

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.markers.formats.registry import FORMATS, find_format, read_capture
from tests.markers.formats.c3d_bytes import C3dFile
from tests.markers.formats.test_plain_csv import HEADER as PLAIN_HEADER
from tests.markers.formats.test_qualisys_tsv import HEADER, ROWS
from tests.markers.formats.test_vendor_text import MOTIVE, TRC, VICON

TRIALS = 200
"""Damaged files of each kind; thousands were tried once, see docs/marker-formats.md."""
_POINTS = np.tile(np.arange(1.0, 13.0).reshape(1, 3, 4), (40, 1, 1)) * [1, 1, 1, 0]
FILES = {
    "c3d": C3dFile(_POINTS, ("a", "b", "c")).to_bytes(),
    "c3d of integers": C3dFile(_POINTS, ("a", "b", "c"), "mips", 0.1).to_bytes(),
    "qualisys": "\n".join((*HEADER, *ROWS)).encode(),
    "vicon": VICON.encode(),
    "motive": MOTIVE.encode(),
    "trc": TRC.encode(),
    "plain": "\n".join((PLAIN_HEADER, "1,2,3,30,40,50", "1,2,3,nan,,", "1,2,3,30,41,50")).encode(),
}


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """Return data with a few bytes changed, removed, inserted or copied, or the end cut off."""
    damaged = bytearray(data)
    # The samples of a C3D file fill most of it; its header and parameters lie in front.
    reach = min(len(damaged), 1100)
    for _ in range(rng.integers(1, 6)):
        place, kind = int(rng.integers(reach)), rng.integers(6)
        piece = rng.integers(0, 256, int(rng.integers(1, 8)), dtype=np.uint8).tobytes()
        if kind == 0:
            damaged[place : place + 1] = bytes([rng.choice([0, 255, 127, 128, 9, 10, 44, 45, 48, 57])])
        elif kind == 1:
            damaged[place : place + 1] = piece[:1]
        elif kind == 2:
            del damaged[place : place + len(piece)]
        elif kind == 3:
            damaged[place:place] = piece
        elif kind == 4:
            other = int(rng.integers(reach))
            damaged[place : place + 20] = damaged[other : other + 20]
        elif rng.random() < 0.3:
            del damaged[place:]
    return bytes(damaged)


def test_every_format_is_damaged(tmp_path: Path) -> None:
    path = tmp_path / "file"
    found = set()
    for data in FILES.values():
        path.write_bytes(data)
        found.add(find_format(path).description)
    assert found == {each.description for each in FORMATS}


def refusal(path: Path) -> str | None:
    """Return the error of reading a file, None if it is read."""
    try:
        read_capture(path)
    except InputError as error:
        return str(error)
    return None


@pytest.mark.parametrize("name", FILES)
def test_damaged_files_are_read_or_refused_in_one_sentence(tmp_path: Path, name: str) -> None:
    rng, path = np.random.default_rng(len(name)), tmp_path / "file"
    refusals = 0
    for _ in range(TRIALS):
        path.write_bytes(mutated(FILES[name], rng))
        message = refusal(path)
        if message is not None:
            refusals += 1
            assert message.isprintable()
            assert len(message) < 500
    assert refusals

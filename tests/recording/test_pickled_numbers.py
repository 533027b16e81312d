"""Pickles of numbers are read without running what they name."""

import os
import pickle
import struct
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.errors import InputError
from depthtrack.recording.pickled_numbers import read_pickled_numbers

FIELDS: dict[str, Any] = {
    "joints": np.arange(63.0).reshape(21, 3),
    "columns": np.asfortranarray(np.arange(9.0).reshape(3, 3)),
    "flags": np.array([True, False]),
    "big": np.arange(3, dtype=">i4"),
    "scalar": np.float64(2.5),
    "name": "021_bleach_cleanser",
    "number": -7,
    "list": [1, 2.5, (3, None)],
    "none": None,
}


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_every_protocol_is_read(protocol: int, tmp_path: Path) -> None:
    (tmp_path / "a.pkl").write_bytes(pickle.dumps({**FIELDS, "objects": np.array([{}, None])}, protocol))
    found = read_pickled_numbers(tmp_path / "a.pkl")
    for name, value in FIELDS.items():
        if isinstance(value, np.ndarray):
            np.testing.assert_array_equal(found[name], value)
            assert found[name].dtype == value.dtype
        elif name == "list":
            assert found[name] == [1, 2.5, [3, None]]
        else:
            assert found[name] == value
    assert found["objects"] is None


def test_a_pickle_of_python_2_is_read(tmp_path: Path) -> None:
    """Its text and the bytes of its arrays are both short strings."""

    def text(value: bytes) -> bytes:
        return b"U" + bytes([len(value)]) + value

    dtype = (
        b"cnumpy\ndtype\n"
        + text(b"f8")
        + b"K\0K\1\x87R(K\3"
        + text(b"<")
        + b"NNNJ\xff\xff\xff\xffJ\xff\xff\xff\xffK\0tb"
    )
    array = b"cnumpy.core.multiarray\n_reconstruct\ncnumpy\nndarray\nK\0\x85" + text(b"b") + b"\x87R"
    state = b"(K\1K\3\x85" + dtype + b"\x89" + text(struct.pack("<3d", 1.5, -2.0, 1e300)) + b"tb"
    (tmp_path / "a.pkl").write_bytes(b"\x80\2}" + text(b"handJoints3D") + array + state + b"s.")
    np.testing.assert_array_equal(read_pickled_numbers(tmp_path / "a.pkl")["handJoints3D"], [1.5, -2.0, 1e300])


class _Attack:
    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[Any, tuple[str]]:
        return os.mkdir, (str(self.path),)


def test_a_call_in_the_file_is_not_made(tmp_path: Path) -> None:
    (tmp_path / "a.pkl").write_bytes(pickle.dumps({"bad": _Attack(tmp_path / "made"), "good": 1}))
    assert read_pickled_numbers(tmp_path / "a.pkl") == {"bad": None, "good": 1}
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize("data", [b"", b"\x80\2", b"N.", b"]a.", b"(lp0\n.", b"\x80\2}r\xff\xff\xff\x7f.", b"}(K\1u."])
def test_another_file_is_one_sentence(data: bytes, tmp_path: Path) -> None:
    (tmp_path / "a.pkl").write_bytes(data)
    if data.startswith(b"\x80\2}r"):  # a large memo index costs nothing
        assert read_pickled_numbers(tmp_path / "a.pkl") == {}
        return
    with pytest.raises(InputError, match="must be a pickled dictionary"):
        read_pickled_numbers(tmp_path / "a.pkl")


@given(place=st.integers(0, 600), value=st.integers(0, 255))
def test_changed_bytes_never_raise_anything_else(
    place: int, value: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    data = bytearray(pickle.dumps(FIELDS, 2))
    data[place % len(data)] = value
    path = tmp_path_factory.getbasetemp() / "changed.pkl"
    path.write_bytes(data)
    with suppress(InputError):
        read_pickled_numbers(path)

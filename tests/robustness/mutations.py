"""Seeded mutations of files: bytes, tokens of text, values of JSON, members of zip files."""

import io
import json
import re
import zipfile
from collections.abc import Callable
from typing import Any

import numpy as np

Mutation = Callable[[bytes, np.random.Generator], bytes]

NUMBERS = (
    *("nan", "inf", "-inf", "NaN", "Infinity", "1e999", "-1e999", "1e-999", "1e308", "-1e308", "5e-324"),
    *("0", "-0", "-1", "0.5", "1e6", "2147483648", "4294967296", "9223372036854775808", "18446744073709551616"),
    *("9" * 30, "9" * 400, "9" * 5000, "0." + "1" * 8000, "1_0", "٣", "0x1F", "1e", "+", "1,5", "", " ", "null"),
)
"""Text in place of a number."""
TEXTS = (
    *("", "\x1b[31mred\x1b[0m", "a\nb", "a\rb", "\x00", "../../../etc/passwd", "/dev/zero", "C:\\x", "A" * 100_000),
    *("</script><script>alert(1)</script>", "$\\frac{$", "{{ 1/0 }}", "%s%n", "\u202e", "é" * 50, ".", "~"),
)
"""Text in place of a name."""
RAW = (
    *("NaN", "Infinity", "-Infinity", "1e999", "1e-400", "-0", "1E308", "9" * 400, "9" * 5000, "0." + "1" * 8000),
    *(r'"\ud800"', "[" * 60 + "]" * 60, "[" * 3000 + "]" * 3000, '{"a":' * 900 + "1" + "}" * 900),
)
"""Text of values that Python would not write."""
VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1, 0.5, 1e308, 2**63, 2**64, "", "1"),
    *([], {}, [[]], [1, "a"], {"a": 1}, [0] * 5000, [[1, 2], [3]], [None], ["nan"]),
)
_NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
_WORD = re.compile(rb"[A-Za-z_][A-Za-z_0-9./]*")
_BYTES = [0, 255, 127, 128, 9, 10, 13, 34, 44, 45, 48, 57, 91, 123]
_REACH = 1100
"""Bytes from the beginning that hold the headers of binary files."""


def choose(options: tuple[str, ...], rng: np.random.Generator) -> bytes:
    return options[int(rng.integers(len(options)))].encode()


def change_bytes(data: bytes, rng: np.random.Generator) -> bytes:
    """Return data with a few bytes changed, removed, inserted or copied."""
    out = bytearray(data)
    reach = min(len(out), _REACH) if rng.random() < 0.7 else len(out)
    for _ in range(int(rng.integers(1, 6))):
        place, other = (int(rng.integers(reach + 1)) for _ in range(2))
        piece = rng.integers(0, 256, int(rng.integers(1, 8)), dtype=np.uint8).tobytes()
        match int(rng.integers(5)):
            case 0:
                out[place : place + 1] = bytes([int(rng.choice(_BYTES))])
            case 1:
                out[place : place + len(piece)] = piece
            case 2:
                del out[place : place + len(piece)]
            case 3:
                out[place:place] = piece
            case _:
                out[place : place + 20] = out[other : other + 20]
    return bytes(out)


def cut(data: bytes, rng: np.random.Generator) -> bytes:
    """Return the beginning of the data."""
    return data[: int(rng.integers(len(data) + 1))]


def repeat(data: bytes, rng: np.random.Generator) -> bytes:
    """Return the data twice, or with another end or mark of its encoding."""
    ends = (data, b"\xff\xfe", b"\x00" * 64, b"\n" * 1000, b"x" * 200_000)
    marked = rng.random() < 0.2
    return b"\xef\xbb\xbf" + data if marked else data + ends[int(rng.integers(len(ends)))]


def change_numbers(data: bytes, rng: np.random.Generator) -> bytes:
    """Return text with one or a few numbers replaced."""
    return _replace(data, _NUMBER, NUMBERS, rng)


def change_words(data: bytes, rng: np.random.Generator) -> bytes:
    """Return text with one or a few names replaced."""
    return _replace(data, _WORD, TEXTS, rng)


def change_lines(data: bytes, rng: np.random.Generator) -> bytes:
    """Return text with lines dropped, doubled, exchanged or joined, or with other line ends."""
    lines = data.split(b"\n")
    a, b = (int(rng.integers(len(lines))) for _ in range(2))
    match int(rng.integers(5)):
        case 0:
            del lines[a]
        case 1:
            lines.insert(b, lines[a])
        case 2:
            lines[a], lines[b] = lines[b], lines[a]
        case 3:
            lines[a : a + 2] = [b"".join(lines[a : a + 2])]
        case _:
            return b"\r\n".join(lines) if rng.random() < 0.5 else b"\r".join(lines)
    return b"\n".join(lines)


def change_json(data: bytes, rng: np.random.Generator) -> bytes:
    """Return JSON with a value replaced, an entry removed, or one renamed; other data is cut."""
    try:
        value = json.loads(data)
    except ValueError:
        return cut(data, rng)
    places = list(_places(value))
    if not places:
        return b"[]"
    marks: dict[str, str] = {}
    for _ in range(int(rng.integers(1, 3))):
        holder, key = places[int(rng.integers(len(places)))]
        if rng.random() < 0.25 and (not isinstance(holder, dict) or key in holder):
            moved = holder.pop(key) if isinstance(holder, dict) else None
            if rng.random() < 0.3 and isinstance(holder, dict):
                holder[TEXTS[int(rng.integers(len(TEXTS)))]] = moved
            continue
        replacement, raw = _json_value(rng)
        mark = f"\ue000{len(marks)}"
        marks[json.dumps(mark)] = raw
        if not isinstance(holder, list) or key < len(holder):
            holder[key] = mark if raw else replacement
    text = json.dumps(value)
    for mark, raw in marks.items():
        text = text.replace(mark, raw)
    return text.encode()


def change_members(data: bytes, rng: np.random.Generator) -> bytes:
    """Return a zip file with a member changed, packed otherwise, or followed by zeros."""
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    chosen = list(members)[int(rng.integers(len(members)))]
    content = members[chosen]
    is_bomb = rng.random() < 0.03
    content = content + bytes(50_000_000) if is_bomb else change_bytes(content[:_REACH], rng) + content[_REACH:]
    methods = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)
    with zipfile.ZipFile(out, "w", methods[int(rng.integers(len(methods)))]) as archive:
        for name, member in members.items():
            archive.writestr(name, content if name == chosen else member)
    return out.getvalue()


TEXT: tuple[Mutation, ...] = (change_numbers, change_numbers, change_words, change_lines, change_bytes, cut, repeat)
JSON: tuple[Mutation, ...] = (*(change_json,) * 3, change_numbers, change_words, change_bytes, cut, repeat)
BINARY: tuple[Mutation, ...] = (change_bytes, change_bytes, change_bytes, cut, repeat)
ZIP: tuple[Mutation, ...] = (change_members, change_members, change_bytes, cut, repeat)


def _replace(data: bytes, pattern: re.Pattern[bytes], options: tuple[str, ...], rng: np.random.Generator) -> bytes:
    found = list(pattern.finditer(data[:20_000]))
    if not found:
        return change_bytes(data, rng)
    for match in sorted(rng.choice(len(found), min(len(found), int(rng.integers(1, 4))), replace=False), reverse=True):
        start, end = found[match].span()
        data = data[:start] + choose(options, rng) + data[end:]
    return data


def _places(value: Any) -> Any:
    """Yield each list or object with each of its keys, at any level."""
    keys = value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    for key in list(keys):
        yield value, key
        yield from _places(value[key])


def _json_value(rng: np.random.Generator) -> tuple[Any, str]:
    """Return a value, or the text of one that Python would not write."""
    if rng.random() < 0.4:
        return None, RAW[int(rng.integers(len(RAW)))]
    every = (*VALUES, *TEXTS)
    return every[int(rng.integers(len(every)))], ""

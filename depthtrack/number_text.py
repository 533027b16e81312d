"""Numbers in text files: one reader for all text formats.

A number has at most `LONGEST` ASCII characters. Python also reads `1_0` and digits of other scripts, other programs do
not.
"""

from collections.abc import Sequence

LONGEST = 128
"""Characters of a number at most; the shortest text of a double has up to 24, of formats with many digits some more."""
_MOST_DIGITS = 18
"""Digits of a whole number at most, so that it has 64 bits."""


def parse_number(text: str) -> float:
    """Return the number in a cell, which may be nan or infinite.

    Raises:
        ValueError: if the text is no number.
    """
    if len(text) > LONGEST or "_" in text or not text.isascii():
        raise ValueError(f"expected a number, found {shown(text)}")
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"expected a number, found {shown(text)}") from None


def parse_number_or_blank(text: str) -> float:
    """Return the number in a cell, NaN if it is blank.

    Raises:
        ValueError: if the text is no number.
    """
    return parse_number(text) if text and not text.isspace() else float("nan")


def parse_numbers(texts: Sequence[str]) -> list[float]:
    """Return the numbers in cells; faster than `parse_number` for each.

    Raises:
        ValueError: if a text is no number; it names the first one.
    """
    joined = "".join(texts)
    if "_" not in joined and joined.isascii() and len(max(texts, key=len, default="")) <= LONGEST:
        try:
            return list(map(float, texts))
        except ValueError:
            pass
    return [parse_number(text) for text in texts]


def parse_numbers_or_blanks(texts: Sequence[str]) -> list[float]:
    """Return the numbers in cells, NaN for blank ones.

    Raises:
        ValueError: if a text is no number; it names the first one.
    """
    return parse_numbers([text if text and not text.isspace() else "nan" for text in texts])


def parse_whole_number(text: str) -> int:
    """Return the whole number in a cell.

    Raises:
        ValueError: if the text is no whole number of at most 18 digits.
    """
    stripped = text.strip(" \t\r\n")
    digits = stripped.removeprefix("-")
    if not (digits.isascii() and digits.isdigit() and len(digits) <= _MOST_DIGITS):
        raise ValueError(f"expected a whole number, found {shown(text)}")
    return int(stripped)


def shown(text: str) -> str:
    """Return the beginning of a text in quotes."""
    return repr(text if len(text) <= 40 else f"{text[:37]}...")

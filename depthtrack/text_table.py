"""Tables of text for a terminal."""

from collections.abc import Sequence

from depthtrack.errors import printable


def aligned(lines: Sequence[Sequence[str]], left: int, text: tuple[int, ...] = ()) -> list[str]:
    """Return rows of cells as lines of text.

    The first `left` columns and those in `text` are flush left, the others flush right. Control characters of names are
    escaped.
    """
    lines = [[printable(cell) for cell in cells] for cells in lines]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]

    def padded(cells: Sequence[str]) -> list[str]:
        sized = enumerate(zip(cells, widths, strict=True))
        return [cell.ljust(width) if n < left or n in text else cell.rjust(width) for n, (cell, width) in sized]

    return ["  ".join(padded(cells)).rstrip() for cells in lines]

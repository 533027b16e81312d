"""Tables for people to read in a terminal."""

from collections.abc import Sequence


def aligned(lines: Sequence[Sequence[str]], left: int) -> list[str]:
    """Rows of cells as lines of text, the first `left` columns flush left, the others flush right."""
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]

    def padded(cells: Sequence[str]) -> list[str]:
        sized = enumerate(zip(cells, widths, strict=True))
        return [cell.ljust(width) if n < left else cell.rjust(width) for n, (cell, width) in sized]

    return ["  ".join(padded(cells)).rstrip() for cells in lines]

"""The bar that long work shows where people watch."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import TypeVar

    Item = TypeVar("Item")


def bar(items: "Iterable[Item]", unit: str = "frame") -> "Iterable[Item]":
    """`items` with a progress bar on a terminal, after a second."""
    from tqdm import tqdm

    shown: Iterable[Item] = tqdm(items, unit=unit, delay=1, leave=False, disable=None)
    return shown

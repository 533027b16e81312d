"""Progress bars of long work, only on a terminal."""

from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from typing import Any, TypeVar

    Item = TypeVar("Item")

DELAY = 1.0
"""Seconds of work before a bar appears."""


def bar(
    items: "Iterable[Item]", unit: str = "frame", total: int | None = None, heading: str | None = None, initial: int = 0
) -> "Iterable[Item]":
    """Return the items with a progress bar around them.

    initial: number of items that were finished before, of `total`.
    """
    from tqdm import tqdm

    shown: Iterable[Item] = tqdm(
        items, heading, total, unit=unit, initial=initial, delay=DELAY, leave=False, disable=None
    )
    return shown


def counter(total: int | None = None, unit: str = "frame", initial: int = 0, leave: bool = False) -> "Any":
    """Return a tqdm bar to update by hand, as a context manager.

    leave: keep the bar on the terminal at the end.
    """
    from tqdm import tqdm

    return tqdm(total=total, unit=unit, initial=initial, leave=leave, disable=None)


@contextmanager
def percent_bar() -> "Iterator[Callable[[str, float], None]]":
    """Yield a function that shows the current step and the share done, 0 to 1."""
    from tqdm import tqdm

    with tqdm(total=100, unit="%", bar_format="{desc}: {percentage:3.0f}% |{bar}|", leave=False, disable=None) as shown:

        def show(step: str, share: float) -> None:
            shown.set_description_str(step)
            shown.update(round(100 * share) - shown.n)

        yield show

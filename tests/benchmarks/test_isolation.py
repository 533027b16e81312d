"""Test a generator in its own process: items and errors arrive."""

import os
import time
from collections.abc import Iterator

import pytest

from depthtrack.benchmarks.speed.isolation import ProcessFailureError, in_own_process
from depthtrack.errors import InputError


def numbers_then(end: str) -> Iterator[int]:
    yield os.getpid()
    yield 2
    if end == "raise":
        raise KeyError("lost")
    if end == "reject":
        raise InputError("this cannot be: do that")
    if end == "die":
        os._exit(7)


def slow() -> Iterator[int]:
    time.sleep(60)
    yield 1


def test_all_items_arrive() -> None:
    process, *rest = in_own_process(numbers_then, "well", timeout=60)
    assert process != os.getpid()
    assert rest == [2]


@pytest.mark.parametrize(
    ("end", "error", "message"),
    [
        ("raise", ProcessFailureError, "KeyError: 'lost'"),
        ("reject", InputError, "this cannot be: do that"),
        ("die", ProcessFailureError, "exit code 7"),
    ],
)
def test_a_failure_comes_after_the_items(end: str, error: type[Exception], message: str) -> None:
    items = in_own_process(numbers_then, end, timeout=60)
    assert next(items) != os.getpid()
    assert next(items) == 2
    with pytest.raises(error, match=message):
        next(items)


def test_a_late_item_is_an_error() -> None:
    with pytest.raises(ProcessFailureError, match="after 1 s without a result"):
        next(in_own_process(slow, timeout=1))


def test_closing_the_generator_stops_the_process() -> None:
    items = in_own_process(numbers_then, "well", timeout=60)
    process = next(items)
    items.close()
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)

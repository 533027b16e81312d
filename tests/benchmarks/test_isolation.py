"""Work in a process of its own: its items come through, and so does the reason when it fails."""

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
    if end == "refuse":
        raise InputError("this cannot be: do that")
    if end == "die":
        os._exit(7)


def silent() -> Iterator[int]:
    time.sleep(60)
    yield 1


def test_all_that_is_given_arrives() -> None:
    process, *rest = in_own_process(numbers_then, "well", patience=60)
    assert process != os.getpid()
    assert rest == [2]


@pytest.mark.parametrize(
    ("end", "error", "message"),
    [
        ("raise", ProcessFailureError, "KeyError: 'lost'"),
        ("refuse", InputError, "this cannot be: do that"),
        ("die", ProcessFailureError, "exit code 7"),
    ],
)
def test_a_failure_comes_after_what_was_given(end: str, error: type[Exception], message: str) -> None:
    items = in_own_process(numbers_then, end, patience=60)
    assert next(items) != os.getpid()
    assert next(items) == 2
    with pytest.raises(error, match=message):
        next(items)


def test_silence_is_not_waited_for() -> None:
    with pytest.raises(ProcessFailureError, match="gave nothing for 1 s"):
        next(in_own_process(silent, patience=1))


def test_leaving_early_stops_the_process() -> None:
    items = in_own_process(numbers_then, "well", patience=60)
    process = next(items)
    items.close()
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)

"""Run a generator in its own process, so that drivers may crash, hang or change the process."""

import multiprocessing
from collections.abc import Callable, Generator, Iterable
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from depthtrack.errors import DepthtrackError

Item = TypeVar("Item")


class ProcessFailureError(DepthtrackError):
    """A function in its own process raised, ended the process, or yielded nothing in time."""


def in_own_process(
    function: Callable[..., Iterable[Item]], *arguments: object, timeout: float
) -> Generator[Item, None, None]:
    """Yield the items of `function(*arguments)`, computed in a spawned process.

    function, arguments: picklable, as are the items.
    timeout: seconds to wait for each item.

    Raises:
        DepthtrackError: if the function raised it.
        ProcessFailureError: if the function raised another error, its process ended, or an item came too late.
    """
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_send_all, args=(theirs, function, arguments), daemon=True)
    process.start()
    theirs.close()
    try:
        while ours.poll(timeout):
            done, message = ours.recv()
            if isinstance(message, DepthtrackError):
                raise message
            if done:
                return
            yield message
        raise ProcessFailureError(f"it was stopped after {timeout:g} s without a result")
    except EOFError:
        process.join(timeout)
        raise ProcessFailureError(f"its process ended (exit code {process.exitcode})") from None
    finally:
        ours.close()
        process.kill()
        process.join()


def _send_all(pipe: Connection, function: Callable[..., Iterable[Any]], arguments: tuple[object, ...]) -> None:
    try:
        for item in function(*arguments):
            pipe.send((False, item))
        pipe.send((True, None))
    except BrokenPipeError:
        pass  # the other process has stopped reading
    except DepthtrackError as error:
        pipe.send((True, error))
    except Exception as error:
        pipe.send((True, ProcessFailureError(f"it failed: {type(error).__name__}: {error}")))

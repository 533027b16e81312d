"""Work in a fresh process, item by item: a driver that crashes, hangs or claims the whole process harms nobody else."""

import multiprocessing
from collections.abc import Callable, Generator, Iterable
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from depthtrack.errors import DepthtrackError

Item = TypeVar("Item")


class ProcessFailureError(DepthtrackError):
    """What ran in a process of its own raised, died or fell silent; the message says which."""


def in_own_process(
    function: Callable[..., Iterable[Item]], *arguments: object, patience: float
) -> Generator[Item, None, None]:
    """What `function(*arguments)` yields, computed in a fresh (spawned) process as it is asked for.

    Function, arguments and items must be picklable. Raises the DepthtrackError that it raised, and ProcessFailureError
    for other exceptions, a process that ends by itself, and one that gives nothing for `patience` seconds.
    """
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_send_all, args=(theirs, function, arguments), daemon=True)
    process.start()
    theirs.close()
    try:
        while ours.poll(patience):
            done, message = ours.recv()
            if isinstance(message, DepthtrackError):
                raise message
            if done:
                return
            yield message
        raise ProcessFailureError(f"it gave nothing for {patience:g} s and was stopped")
    except EOFError:
        process.join(patience)
        raise ProcessFailureError(f"its process ended by itself (exit code {process.exitcode})") from None
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
        pass  # nobody listens any more
    except DepthtrackError as error:
        pipe.send((True, error))
    except Exception as error:
        pipe.send((True, ProcessFailureError(f"it failed: {type(error).__name__}: {error}")))

"""Tickets for the poses of a batch: any number of threads take them, each exactly once, batch after batch.

Tickets and their limit carry the number of the batch in their upper half, so that a thread that was held up between
looking and taking can never mistake a ticket of one batch for one of another.
"""

import numba
import numpy as np

from depthtrack.rendering.raster.work_queue.atomics import fetch_add, peek, publish, relax
from depthtrack.simd.vectors import kernel_part
from depthtrack.types import Index

Tickets = Index

# A cache line each: what one thread writes often must not slow another's reading.
_NEXT, _LIMIT, _LEAVE, _DONE = 0, 8, 16, 24


def new_tickets(threads: int) -> Tickets:
    """For so many threads, numbered from 0, the one that offers batches; an empty batch to begin with."""
    return np.zeros(_DONE + 8 * threads, np.int64)


@numba.njit(cache=True, nogil=True)
def submit(tickets: Tickets, count: int) -> None:
    """Begin a batch of `count`; all of the last one must be done."""
    batch = ((peek(tickets, _LIMIT) >> 32) + 1) << 32
    tickets[_DONE:] = 0
    publish(tickets, _LIMIT, batch + count)
    publish(tickets, _NEXT, batch)


@kernel_part
def pop(tickets, thread, spin_limit):
    """The next ticket; -1 for thread 0 once all are done, for others when told to leave, for any out of patience.

    `spin_limit` counts looks at a batch that has no more tickets: a hundred take a few microseconds.
    """
    looks = 0
    while looks < spin_limit:
        limit, ticket = peek(tickets, _LIMIT), peek(tickets, _NEXT)
        if ticket < limit and ticket >> 32 == limit >> 32:
            ticket = fetch_add(tickets, _NEXT, 1)
            limit = peek(tickets, _LIMIT)
            if ticket < limit and ticket >> 32 == limit >> 32:
                return ticket & 0xFFFFFFFF
        elif peek(tickets, _LEAVE) != 0 if thread > 0 else is_done(tickets):
            break
        relax()
        looks += 1
    return -1


@kernel_part
def done(tickets, thread):
    """Say that the work of a ticket is done."""
    place = _DONE + 8 * thread
    publish(tickets, place, tickets[place] + 1)


@numba.njit(cache=True, nogil=True)
def is_done(tickets: Tickets) -> bool:
    """Whether all of the batch is."""
    done = 0
    for place in range(_DONE, tickets.shape[0], 8):
        done += peek(tickets, place)
    return done == peek(tickets, _LIMIT) & 0xFFFFFFFF


def tell_to_leave(tickets: Tickets, leave: bool) -> None:
    """Whether threads beyond the first shall go at once when there is no ticket."""
    tickets[_LEAVE] = leave

"""Tickets for the poses of a batch: each is taken by one thread, batch after batch.

A ticket and the limit hold the number of the batch in their upper 32 bits. So a thread that was interrupted between
its check and its take cannot take a ticket of one batch for one of another.
"""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.rendering.raster.work_queue.atomics import fetch_add, load_acquire, spin_pause, store_release
from depthtrack.simd.vectors import kernel_part
from depthtrack.types import Index

Tickets = Index
"""The counters (24 + 8 N,) of N threads."""

# Counters are a cache line apart, so that a write by one thread does not slow the reads of another.
_NEXT, _LIMIT, _DISMISSED, _COMPLETED = 0, 8, 16, 24


def new_tickets(threads: int) -> Tickets:
    """Return the tickets of an empty batch for a number of threads; thread 0 submits batches."""
    return np.zeros(_COMPLETED + 8 * threads, np.int64)


@compiled(nogil=True)
def submit(tickets: Tickets, count: int) -> None:
    """Begin a batch of `count` poses; no thread may hold a ticket of the last batch."""
    batch = ((load_acquire(tickets, _LIMIT) >> 32) + 1) << 32
    tickets[_COMPLETED:] = 0
    store_release(tickets, _LIMIT, batch + count)
    store_release(tickets, _NEXT, batch)


@kernel_part
def pop(tickets, thread, spin_limit):
    """Return the next pose, or -1.

    spin_limit: polls of a batch without tickets, after which any thread gets -1; at least 1.

    Thread 0 gets -1 as soon as the batch is complete. The others get -1 as soon as they are dismissed and the batch has
    no tickets.
    """
    polls = 0
    while polls < spin_limit:
        limit, ticket = load_acquire(tickets, _LIMIT), load_acquire(tickets, _NEXT)
        if ticket < limit and ticket >> 32 == limit >> 32:
            ticket = fetch_add(tickets, _NEXT, 1)
            limit = load_acquire(tickets, _LIMIT)
            if ticket < limit and ticket >> 32 == limit >> 32:
                return ticket & 0xFFFFFFFF
        elif load_acquire(tickets, _DISMISSED) != 0 if thread > 0 else is_complete(tickets):
            break
        spin_pause()
        polls += 1
    return -1


@kernel_part
def complete(tickets, thread):
    """Count a pose of this thread as scored."""
    counter = _COMPLETED + 8 * thread
    store_release(tickets, counter, tickets[counter] + 1)


@compiled(nogil=True)
def is_complete(tickets: Tickets) -> bool:
    """Return whether all poses of the batch are scored."""
    completed = 0
    for counter in range(_COMPLETED, tickets.shape[0], 8):
        completed += load_acquire(tickets, counter)
    return completed == load_acquire(tickets, _LIMIT) & 0xFFFFFFFF


def dismiss(tickets: Tickets, dismissed: bool) -> None:
    """Set whether threads 1 and up stop polling a batch without tickets."""
    tickets[_DISMISSED] = dismissed

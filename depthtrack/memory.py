"""Reuse of freed memory, for images that come and go with every frame."""

import ctypes
import sys

_TRIM_THRESHOLD, _TOP_PAD, _MMAP_THRESHOLD = -1, -2, -3
"""Parameters of `mallopt` in glibc's malloc.h."""
_KEPT = 256 << 20
"""Bytes of freed memory that a process keeps at most before it returns some."""
_PAD = 16 << 20
"""Bytes that are requested beyond what is needed."""
_LARGEST = 32 << 20
"""Bytes from which on memory is mapped and returned by itself; glibc accepts no more."""


def keep_freed_memory() -> None:
    """Let this process keep freed memory for the next arrays, where its C library can.

    By default glibc returns an image to the system as soon as it is freed. Each new one then costs a page fault per
    4 KiB, which takes longer than most operations on it.
    """
    if not sys.platform.startswith("linux"):
        return
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError):  # another C library
        return
    for parameter, value in ((_MMAP_THRESHOLD, _LARGEST), (_TRIM_THRESHOLD, _KEPT), (_TOP_PAD, _PAD)):
        mallopt(parameter, value)

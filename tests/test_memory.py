"""Reuse of freed memory."""

import subprocess
import sys

import pytest

_FAULTS = """
import resource, sys
import numpy as np
from depthtrack.memory import keep_freed_memory
if sys.argv[1] == "keep":
    keep_freed_memory()
def make():
    for _ in range(100):
        image = np.ones((480, 640), np.float32)
        image * image
make()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
make()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="glibc's allocator is that of Linux")
def test_images_reuse_freed_memory() -> None:
    kept, freed = (
        int(subprocess.run([sys.executable, "-c", _FAULTS, mode], capture_output=True, text=True, check=True).stdout)
        for mode in ("keep", "free")
    )
    assert kept < 100
    assert kept <= freed

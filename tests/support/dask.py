"""Dask schedulers and workers in processes of their own."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]


@contextmanager
def dask_process(*arguments: str) -> Iterator[subprocess.Popen[bytes]]:
    """A `dask` command in a process of its own, which can import the tests."""
    command = [sys.executable, "-m", "dask", *arguments]
    process = subprocess.Popen(command, cwd=ROOT, env=os.environ | {"PYTHONPATH": str(ROOT)}, stderr=subprocess.DEVNULL)
    try:
        yield process
    finally:
        process.terminate()
        process.wait()


@contextmanager
def dask_scheduler(folder: Path) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """A Dask scheduler on loopback: its address and its process."""
    pytest.importorskip("distributed", reason="Dask is not installed: pip install 'depthtrack[sweep]'")
    note = folder / "scheduler.json"
    where = ("--host", "127.0.0.1", "--port", "0", "--no-dashboard", f"--scheduler-file={note}")
    with dask_process("scheduler", *where) as process:
        for _ in range(600):
            if note.exists() and note.read_text().endswith("}"):
                break
            time.sleep(0.1)
        yield json.loads(note.read_text())["address"], process


def dask_workers(address: str, folder: Path) -> AbstractContextManager[Any]:
    """Two worker processes of a scheduler."""
    return dask_process(
        "worker", address, "--nworkers=2", "--nthreads=1", "--no-dashboard", f"--local-directory={folder}"
    )

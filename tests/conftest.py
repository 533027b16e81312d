"""Shared fixtures."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

# A first call compiles, and a loaded machine is slow: time limits of single examples mean nothing here.
settings.register_profile("depthtrack", deadline=None, max_examples=30, derandomize=True)
settings.load_profile("depthtrack")


@pytest.fixture(scope="session")
def real_data() -> Path:
    """Folder of the real recordings; the test is skipped where they are absent."""
    folder = Path(os.environ.get("DEPTHTRACK_DATA", Path(__file__).parent.parent.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no real recordings at {folder}: set DEPTHTRACK_DATA to run this test")
    return folder

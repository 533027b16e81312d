"""Shared fixtures, and how tests are divided among the workers of pytest-xdist."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from depthtrack.hand.rig.gltf_writer import export_glb
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.synthesis.generate import Synthesis, Synthesiser

# A first call compiles, and a loaded machine is slow: time limits of single examples mean nothing here.
settings.register_profile("depthtrack", deadline=None, max_examples=30, derandomize=True)
settings.load_profile("depthtrack")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep each module on one worker, which makes its fixtures once, and start with slow modules.

    A module may name another group by `pytest.mark.xdist_group`, to share a worker with other modules.
    """
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    for item in items:
        if item.get_closest_marker("xdist_group") is None:
            item.add_marker(pytest.mark.xdist_group(str(item.path.relative_to(item.config.rootpath))))
    if os.environ.get("PYTEST_XDIST_WORKER"):
        items.sort(key=lambda item: item.path not in slow)


@pytest.fixture(scope="session", autouse=True)
def failures_in_frames_end_tests() -> Iterator[None]:
    """Raise unexpected failures inside a frame, which runs record and pass over, so that no test hides one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("depthtrack.tracking.guided_segmentation.failure_text", lambda error: None)
        yield


@pytest.fixture(scope="session")
def everyday() -> Synthesiser:
    """The everyday motion of a hand of spheres and cylinders, seen by a perfect sensor."""
    return Synthesiser(Synthesis())


@pytest.fixture(scope="session")
def everyday_skin() -> Synthesiser:
    """The everyday motion of a hand with a skin, seen by a perfect sensor."""
    return Synthesiser(Synthesis(model="skin"))


@pytest.fixture(scope="session")
def real_data() -> Path:
    """The folder that DEPTHTRACK_DATA names; tests of real recordings are skipped without it."""
    folder = os.environ.get("DEPTHTRACK_DATA")
    if not folder or not Path(folder).is_dir():
        pytest.skip("no real recordings: set DEPTHTRACK_DATA to their folder")
    return Path(folder)


@pytest.fixture(scope="session")
def own_glb(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A rigged hand: the average hand's built skin, exported as GLB."""
    pytest.importorskip("pygltflib", reason="rigged hands need the extra: pip install 'depthtrack[gltf]'")
    path = tmp_path_factory.mktemp("rig") / "own.glb"
    export_glb(Skin.of(HandShape()), path)
    return path

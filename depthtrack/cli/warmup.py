"""`depthtrack warmup`: compile the kernels ahead of the first run."""

from dataclasses import dataclass
from typing import Any

SCENES: tuple[dict[str, Any], ...] = (
    {"model": "skin", "sensor": "kinect1", "background": "room"},
    {"model": "primitives"},
)
"""Synthetic recordings: with colour, noise and a skin; depth alone, of spheres and cylinders."""
TRACKERS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("hybrid", {}),
    ("ik", {"surface": "cylinders"}),
    ("pso", {}),
)
"""Trackers that use all kernels together, and their options."""


@dataclass(frozen=True)
class Command:
    """Compile the kernels of trackers and marker layouts, so that no first run is late.

    The first use of a kernel compiles it, which takes a minute or two for all. The code is kept for later runs:
    run this once when you make a container. `depthtrack doctor` states the folder, and NUMBA_CACHE_DIR changes it.
    """

    def run(self) -> None:
        from time import perf_counter

        from depthtrack.compilation import cache_folder
        from depthtrack.errors import DepthtrackError

        begun, folder = perf_counter(), cache_folder()
        if folder is None:
            raise DepthtrackError("no folder for compiled kernels is writable: set NUMBA_CACHE_DIR to one that is")
        compile_kernels()
        print(f"kernels compiled in {perf_counter() - begun:.0f} s; they are kept in {folder}")


def compile_kernels() -> None:
    """Track synthetic recordings of three frames with each tracker, and search a marker layout."""
    from pathlib import Path
    from tempfile import TemporaryDirectory

    import depthtrack
    from depthtrack.cli.progress import counter

    with TemporaryDirectory() as folder, counter(len(SCENES) * len(TRACKERS) + 1) as shown:
        for number, scene in enumerate(SCENES):
            recording = depthtrack.synthesise("everyday", Path(folder) / f"recording-{number}", frames=3, **scene)
            for name, options in TRACKERS:
                shown.set_postfix_str(f"{name} on {scene['model']}")
                list(depthtrack.track(recording, "truth", depthtrack.tracker_config(name, **options)))
                shown.update()
        shown.set_postfix_str("marker layouts")
        compile_layouts()
        shown.update()


def compile_layouts() -> None:
    """Search layouts for a few postures with each objective, and reconstruct poses from one."""
    import numpy as np

    from depthtrack.hand.postures import POSTURES
    from depthtrack.hand.shape import HandShape
    from depthtrack.markers.layout.candidates import Candidates
    from depthtrack.markers.layout.expected_error import expected_errors
    from depthtrack.markers.layout.options import OBJECTIVES, LayoutOptions, QualityOptions
    from depthtrack.markers.layout.quality import LayoutQuality
    from depthtrack.markers.layout.search import find_layout_of
    from depthtrack.solver.options import SwarmOptions

    postures, hand = np.array(list(POSTURES.values())), HandShape()
    candidates, few = Candidates.on_skin(hand), LayoutOptions(swarm=SwarmOptions(particles=8, generations=4), kicks=0)
    for objective in OBJECTIVES:
        quality = LayoutQuality.of(candidates, postures, QualityOptions(objective=objective, components=3))
        found = find_layout_of(quality, 3, few)
    expected_errors(candidates.layout(found.rows, "warmup").on(hand), [postures], 3, True, 0.0)

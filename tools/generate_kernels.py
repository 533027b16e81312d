"""Write depthtrack/kernels.json: the kernels that trackers, layouts and calibration call.

python tools/generate_kernels.py            # compile kernels and write the list
python tools/generate_kernels.py --print    # print the kernels that are called
"""

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

# The checkout that this script lies in, whatever is installed.
sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from numba.core import event
from numba.core.dispatcher import Dispatcher

import depthtrack
from depthtrack.calibration.joint_optimisation import fit_jointly
from depthtrack.calibration.residuals import CalibrationView
from depthtrack.geometry.camera import Camera
from depthtrack.hand.displacement_grid import NODES
from depthtrack.hand.pose import make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.shape import HandShape
from depthtrack.hand.size_parameters import COUNT
from depthtrack.hand.skin.mesh import Skin
from depthtrack.kernel_list import LIST, Kernel, text_of
from depthtrack.markers.layout.candidates import Candidates
from depthtrack.markers.layout.expected_error import expected_errors
from depthtrack.markers.layout.options import OBJECTIVES, LayoutOptions, QualityOptions
from depthtrack.markers.layout.quality import LayoutQuality
from depthtrack.markers.layout.search import find_layout_of
from depthtrack.rendering.triangles import rasterise
from depthtrack.segmentation.observation import Observation
from depthtrack.solver.options import SwarmOptions

SCENES: tuple[dict[str, Any], ...] = (
    {"model": "skin", "sensor": "kinect1", "background": "room"},
    {"model": "primitives", "sensor": "kinect2"},
)
"""Synthetic recordings: with colour, noise and a skin; depth alone, of spheres and cylinders."""
TRACKERS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("hybrid", {}),
    ("ik", {"surface": "cylinders"}),
    ("pso", {}),
)
"""Trackers that use all kernels together, and their options."""

Call = tuple[str, str, str]
"""Module, name, and the types of the arguments in JSON."""


class Compilations(event.Listener):  # type: ignore[misc]
    """Seconds that each kernel takes to compile."""

    def __init__(self) -> None:
        self.seconds: dict[Call, float] = {}
        self._begun: list[float] = []

    def on_start(self, event: event.Event) -> None:
        self._begun.append(time.process_time())

    def on_end(self, event: event.Event) -> None:
        seconds = time.process_time() - self._begun.pop()
        function = event.data["dispatcher"].py_func
        if not function.__module__.startswith("depthtrack."):
            return
        try:
            call = call_of(function, event.data["args"])
        except ValueError:  # of types that only kernels pass
            return
        self.seconds[call] = seconds


def call_of(function: Any, arguments: Any) -> Call:
    return function.__module__, function.__name__, json.dumps([text_of(each) for each in arguments])


def track() -> None:
    """Track synthetic recordings of three frames with each tracker."""
    with TemporaryDirectory() as folder:
        for number, scene in enumerate(SCENES):
            recording = depthtrack.synthesise("everyday", Path(folder) / f"recording-{number}", frames=3, **scene)
            for name, options in TRACKERS:
                list(depthtrack.track(recording, "truth", depthtrack.tracker_config(name, **options)))


def search_layouts() -> None:
    """Search layouts for a few postures with each objective, and follow one of them."""
    postures, hand = np.array(list(POSTURES.values())), HandShape()
    candidates, few = Candidates.on_skin(hand), LayoutOptions(swarm=SwarmOptions(particles=8, generations=4), kicks=0)
    for objective in OBJECTIVES:
        quality = LayoutQuality.of(candidates, postures, QualityOptions(objective=objective, components=3))
        found = find_layout_of(quality, 3, few)
    expected_errors(candidates.layout(found.rows, "warmup").on(hand), [postures], 3, True, 0.0)


def calibrate() -> None:
    """Fit sizes, skin and pose of a hand to one rendered view of it."""
    camera, skin = Camera(120, 120, 240, 240, 60, 60), Skin.of(HandShape())
    pose = make_pose([0, 0, 0.5], [0, 1, 0, 0], POSTURES["open"])
    vertices = skin.at(pose)
    depth = rasterise(camera, vertices, skin.faces, skin.normals(vertices), skin.face_bodies).depth.astype(np.float32)
    seen = Observation(camera, depth > 0, depth, 0, 0.0, camera.rect, pose[:3].copy(), palm_radius=0.04)
    for count, exact in ((COUNT, False), (COUNT + NODES, True)):
        fit_jointly([CalibrationView(seen)], pose[None], np.zeros(count), "right", iterations=1, exact=exact)


def calls() -> dict[Call, tuple[float, bool]]:
    """Return the kernels that trackers, layouts and calibration use.

    Of each: seconds of compilation in this process, and whether it was loaded for a call by Python.
    """
    compilations = Compilations()
    event.register("numba:compile", compilations)
    track()
    search_layouts()
    calibrate()
    modules = [module for name, module in sys.modules.items() if name.startswith("depthtrack.")]
    kernels = {each for module in modules for each in vars(module).values() if isinstance(each, Dispatcher)}
    loaded = {call_of(each.py_func, types) for each in kernels for types in each.stats.cache_hits}
    return {call: (compilations.seconds.get(call, 0.0), call in loaded) for call in {*loaded, *compilations.seconds}}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--print", action="store_true")
    if parser.parse_args().print:
        print(json.dumps([[*call, *found] for call, found in calls().items()]))
        return
    with TemporaryDirectory() as folder:
        command, environment = [sys.executable, __file__, "--print"], {**os.environ, "NUMBA_CACHE_DIR": folder}
        first, second = (
            json.loads(subprocess.run(command, env=environment, stdout=subprocess.PIPE, check=True).stdout)
            for _ in range(2)
        )
    # The second process loads what Python calls, and nothing that kernels alone call.
    seconds = {tuple(call): round(time, 1) for *call, time, _ in first}
    entries = sorted(((*call,) for *call, _, _ in second), key=lambda call: (-seconds[call], call))
    lines = (
        json.dumps(dict(zip(Kernel._fields, (*call[:2], json.loads(call[2]), seconds[call]), strict=True)))
        for call in entries
    )
    LIST.write_text("[\n" + ",\n".join(lines) + "\n]\n", encoding="utf-8")


if __name__ == "__main__":
    main()

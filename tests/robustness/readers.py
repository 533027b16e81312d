"""Every reader of files from elsewhere, with a sound sample of what it reads."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from depthtrack.evaluation.compare.specs import read_specs
from depthtrack.evaluation.sweep.rows import Journal
from depthtrack.export.uvd import read_uvd, write_uvd
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.camera_files import read_camera
from depthtrack.hand.benchmark_joints import BENCHMARKS
from depthtrack.hand.hand_file import load_hand
from depthtrack.hand.pose import ANGLE_NAMES
from depthtrack.hand.rig.gltf_writer import export_glb
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.hand.synergies import Synergies, load_synergies, save_synergies
from depthtrack.markers.folder.reading import MarkerFolder
from depthtrack.markers.folder.writing import write_marker_folder
from depthtrack.markers.formats.registry import read_capture
from depthtrack.markers.initialisation.started import StartedModel, StartedModels, save_started
from depthtrack.markers.models.layout import load_layout
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.markers.models.model_choice import choose_models
from depthtrack.posture_databases.registry import read_postures
from depthtrack.recording import open_sequence
from depthtrack.recording.keypoints import HEADER, read_keypoints
from depthtrack.recording.run_folder import Run, RunWriter
from depthtrack.recording.run_rows import RunRow
from depthtrack.recording.sequences.capture import CAPTURE_FILE, CaptureDescription
from depthtrack.recording.status import Status
from depthtrack.resources import resource_folder
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.synthesis.motion import load_motion
from depthtrack.tracking.configuration import CONFIGURATIONS
from depthtrack.tracking.run_configuration import RunConfiguration
from tests.markers.formats.test_mutations import FILES as CAPTURES
from tests.recording import test_data_sets as data_sets
from tests.support import lerobot
from tests.support.markers import filled_hands, labelled_hands
from tests.support.oni import write_oni
from tests.support.record3d import copy_as_r3d
from tests.support.recordings import CAMERA, TIMES, depth_at, pose_at, write_plain_tum, write_sample

Make = Callable[[Path], Path]
"""Writes a sample into an empty folder, and returns the path to read."""


@dataclass(frozen=True)
class Reader:
    """A reader with its sample.

    read: reads a path, and returns the number of items.
    only: patterns of the files that are changed; all if empty.
    library: optional library that the reader needs.
    slow: whether a read takes so long that the short form tries few.
    """

    name: str
    make: Make
    read: Callable[[Path], int]
    only: tuple[str, ...] = ()
    library: str | None = None
    slow: bool = False

    @property
    def is_installed(self) -> bool:
        return self.library is None or find_spec(self.library) is not None


def read_recording(path: Path, camera: Camera | None = None) -> int:
    """Read all frames with all that belongs to them; damaged frames are passed over."""
    sequence = open_sequence(path, camera, on_damage="skip")
    count = 0
    for frame in sequence:
        count += 1
        assert np.isfinite(frame.depth).all()
        for beside in (sequence.hand_mask, sequence.exact_depth):
            if frame.index == 0:
                beside(frame.index)
    return count


def read_lerobot(path: Path) -> int:
    return read_recording(path, CAMERA)


def read_run(path: Path) -> int:
    run = Run.load(path)
    configuration = RunConfiguration.of(run)
    configuration.hand_shape()
    configuration.camera_model()
    return len(run.index)


def whole(read: Callable[[Path], object]) -> Callable[[Path], int]:
    """Return a reader of one item."""

    def counted(path: Path) -> int:
        read(path)
        return 1

    return counted


def one(name: str, content: Callable[[], str | bytes | None]) -> Make:
    """Return a function that writes one file."""

    def make(folder: Path) -> Path:
        data = content() or b""
        (folder / name).write_bytes(data.encode() if isinstance(data, str) else data)
        return folder / name

    return make


def _sample(folder: Path) -> Path:
    return write_sample(folder / "sample")


def _tum(folder: Path) -> Path:
    path = write_plain_tum(folder / "tum")
    (path / "camera.json").write_text(CAMERA.to_json())
    return path


def _capture(folder: Path) -> Path:
    world = np.eye(4)
    (folder / CAPTURE_FILE).write_text(CaptureDescription("a", 120.0, 3, CAMERA, world).to_json())
    (folder / "hand.json").write_text(HandShape().to_json())
    return folder


def _record3d(folder: Path) -> Path:
    return copy_as_r3d(write_sample(folder / "unused" / "sample"), folder / "sample.r3d")


def _lerobot(folder: Path) -> Path:
    lerobot.write_info(folder / "set")
    video = folder / "set" / "videos" / lerobot.KEY / "chunk-000" / "file-000.mp4"
    lerobot.write_video(video, [lerobot.codes_of(depth_at(k)) for k in range(3)])
    return folder / "set"


def _video(folder: Path) -> Path:
    codes = [np.rint(1000 * depth_at(k)).astype(np.uint16) for k in range(3)]
    lerobot.write_video(folder / "v.mkv", codes, "ffv1", "gray16le", {}, container_format="matroska")
    return folder / "v.mkv"


def _kinect(folder: Path) -> Path:
    from tests.support.matroska import calibration, write_azure_kinect

    depth, colour = Camera(320, 288, 252.0, 252.0, 160.0, 166.0), Camera(1280, 720, 605.0, 605.0, 638.0, 366.0)
    pictures = [np.full((*colour.shape, 3), 90, dtype=np.uint8)] * 2
    images = [np.full(depth.shape, 600 + k, dtype=np.uint16) for k in range(2)]
    return write_azure_kinect(folder / "k.mkv", images, pictures, calibration(depth, colour, np.eye(4)), (0.0, 0.04))


def _bag(suffix: str, folder: Path) -> Path:
    from tests.support.bags import compose

    return compose(depth_at, None, CAMERA, TIMES[:3]).write(folder / f"a{suffix}")


def _oni(folder: Path) -> Path:
    return write_oni(folder / "a.oni", [np.rint(1000 * depth_at(k)).astype(np.uint16) for k in range(3)])


def _run(folder: Path) -> Path:
    configuration = RunConfiguration(
        "recording", json.loads(CAMERA.to_json()), json.loads(HandShape().to_json()), CONFIGURATIONS["ik"]()
    )
    with RunWriter(folder / "run", configuration.to_fields(), ("segment", "fit")) as run:
        for k in range(4):
            pose = None if k == 2 else pose_at(k)
            status = Status.ABSENT if pose is None else Status.TRACKED
            run.append(RunRow(k, k / 30, status, 1.0, 0.9, pose), {"fit": 1.0})
        run.append(RunRow(4, 4 / 30, Status.ABSENT, np.nan, 0.0, None), {}, "IndexError in a.py:1: b")
    return folder / "run"


def _synergies(folder: Path) -> Path:
    save_synergies(load_synergies("leap").truncated(3), folder / "s.json")
    return folder / "s.json"


def _skin(folder: Path) -> Path:
    SkinColourModel.default().save(folder / "skin.json")
    return folder / "skin.json"


def _markers(folder: Path) -> Path:
    labelled = labelled_hands(frames=30)
    write_marker_folder(folder / "out", labelled, filled=filled_hands(labelled))
    return folder / "out"


def _started(folder: Path) -> Path:
    model = load_layout("13", HandShape())
    one = StartedModel(model, pose_at(0), np.arange(len(model.labels)), 1.0, 0.001, 5.0, 0.9)
    save_started(StartedModels((one, None), 3), folder / "started.json")
    return folder / "started.json"


def _glb(folder: Path) -> Path:
    export_glb(Skin.of(HandShape()), folder / "rig.glb")
    return folder / "rig.glb"


def _layout(folder: Path) -> Path:
    layout = resource_folder("markers/models/layouts") / "13.json"
    (folder / "layout.json").write_bytes(layout.read_bytes())
    return folder / "layout.json"


def _keypoints() -> str:
    rows = [",".join([repr(k / 30), "right", *(f"{x:.3f}" for x in np.linspace(0.1, 0.9, 63))]) for k in range(4)]
    return "\n".join([",".join(HEADER), *rows]) + "\n"


def _angles() -> str:
    rows = [",".join(map(repr, pose_at(k)[7:].tolist())) for k in range(4)]
    return "\n".join([",".join(ANGLE_NAMES), *rows]) + "\n"


def _npz(folder: Path) -> Path:
    np.savez(folder / "hands.npz", joints=data_sets.KEYPOINTS, start=[0], length=[3], right=[True], name=["a"])
    return folder / "hands.npz"


def _uvd(folder: Path) -> Path:
    write_uvd(folder / "labels.txt", BENCHMARKS["icvl"], BENCHMARKS["icvl"].from_keypoints(data_sets.KEYPOINTS))
    return folder / "labels.txt"


def _read_journal(path: Path) -> int:
    with Journal(path, ("x",)):
        return 1


def _captured(path: Path) -> int:
    return len(read_capture(path).positions)


def _model(folder: Path) -> Path:
    (folder / "model.json").write_text(load_layout("13", HandShape()).to_json())
    return folder / "model.json"


def _postures(path: Path) -> int:
    return len(read_postures(path).angles)


def _read_uvd(path: Path) -> int:
    return len(read_uvd(path, BENCHMARKS["icvl"]))


MAT = "\n".join(" ".join(["0.1"] * 26) for _ in range(3))
TRACKERS = '["a"]\ntracker = "ik"\nicp_iterations = 3\n["b"]\ntracker = "pso"\nparticles = 20\n'
JOURNAL = '{"x": 1, "y": 2.5}\n{"x": 2, "y": null}\n'
MOTION = (resource_folder("sequences") / "everyday.toml").read_bytes()
BAGS = (".bag", ".db3", ".mcap")
YAML = (
    "image_width: 32\nimage_height: 24\nK: [30.0, 0.0, 15.0, 0.0, 30.0, 11.0, 0.0, 0.0, 1.0]\nD: [0.1, 0.0, 0.0, 0.0]\n"
)
DATA_SETS = (data_sets.msra15, data_sets.nyu, data_sets.icvl, data_sets.dexycb, data_sets.ho3d)
READERS = (
    Reader("sequence folder", _sample, read_recording, only=("*.txt", "*.json", "*.csv")),
    Reader("images of a sequence", _sample, read_recording, only=("*.png", "*.jpg")),
    Reader("plain TUM folder", _tum, read_recording),
    Reader("capture.json", _capture, read_recording),
    *(Reader(make.__name__, make, read_recording) for make in DATA_SETS),
    Reader("Record3D", _record3d, read_recording, only=("*.r3d",), library="lzfse"),
    Reader("LeRobot", _lerobot, read_lerobot, library="av"),
    Reader("depth video", _video, read_lerobot, library="av"),
    Reader("Azure Kinect", _kinect, read_recording, library="av"),
    *(Reader(f"bag, {each}", partial(_bag, each), read_recording, library="rosbags") for each in BAGS),
    Reader("OpenNI", _oni, read_recording),
    Reader("run folder", _run, read_run),
    Reader("keypoints.csv", one("k.csv", _keypoints), lambda path: len(read_keypoints(path))),
    Reader("camera.json", one("camera.json", CAMERA.to_json), whole(read_camera)),
    Reader("camera.yaml", one("camera.yaml", lambda: YAML), whole(read_camera), library="yaml"),
    Reader("hand.json", one("hand.json", HandShape().to_json), whole(load_hand)),
    Reader("rigged hand", _glb, whole(load_hand), library="pygltflib", slow=True),
    Reader("skin model", _skin, whole(SkinColourModel.load)),
    Reader("synergies", _synergies, whole(Synergies.from_json)),
    Reader("trackers.toml", one("t.toml", lambda: TRACKERS), whole(lambda path: read_specs([str(path)]))),
    Reader("motion.toml", one("m.toml", lambda: MOTION), whole(lambda path: load_motion(str(path)))),
    *(Reader(f"markers, {name}", one("file", partial(CAPTURES.get, name)), _captured) for name in CAPTURES),
    Reader("marker folder", _markers, lambda path: len(MarkerFolder.load(path).labelled.capture)),
    Reader("marker model", _model, whole(MarkerModel.from_json)),
    Reader("marker layout", _layout, whole(lambda path: choose_models([str(path)]))),
    Reader("started models", _started, whole(StartedModels.from_json)),
    Reader("postures, mat", one("p.mat", lambda: MAT), _postures),
    Reader("postures, csv", one("p.csv", _angles), _postures),
    Reader("postures, npz", _npz, _postures, slow=True),
    Reader("uvd", _uvd, _read_uvd),
    Reader("journal", one("rows.jsonl", lambda: JOURNAL), _read_journal),
)

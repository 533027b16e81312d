"""Options of the commands that open one recording."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from depthtrack.cli.reading_arguments import ReadingArguments
from depthtrack.cli.recording_notes import notes_of, print_notes, with_registered_colour
from depthtrack.cli.stated_default import number, stated_default
from depthtrack.errors import InputError

if TYPE_CHECKING:
    from depthtrack.geometry.camera import Camera
    from depthtrack.geometry.camera_files import CameraFile
    from depthtrack.recording import Sequence

# Written out, because reading them from depthtrack.geometry.camera would make `--help` wait for numpy.
PresetName = Literal["kinect1", "kinect2", "realsense", "tum"]
FocalLength = Annotated[float | None, number(0.01, 10**6, metavar="PIXELS")]
Place = Annotated[float | None, number(-(10**6), 10**6, metavar="PIXELS")]


@dataclass(frozen=True)
class RecordingOptions:
    """Recording to open, and its camera if it has none of its own."""

    path: tyro.conf.Positional[Path]
    """The recording: a folder or a file of any format of docs/formats.md."""
    camera: Annotated[Path | None, stated_default(metavar="FILE.json|.yaml")] = None
    """Camera in place of the recording's own: width, height, fx, fy, cx, cy, depth_scale in JSON, or a file of Open3D,
    ROS or Kalibr."""
    camera_preset: Annotated[PresetName | None, stated_default(metavar="kinect1|kinect2|realsense|tum")] = None
    """Nominal camera of a sensor or of the TUM RGB-D benchmark, in place of the recording's own."""
    fx: FocalLength = None
    """Horizontal focal length. Replaces that of the file or preset, or defines a camera together with --depth-scale."""
    fy: FocalLength = None
    """Vertical focal length (default: --fx)."""
    cx: Place = None
    """Column of the principal point (default: the centre of the image)."""
    cy: Place = None
    """Row of the principal point (default: the centre of the image)."""
    on_damage: Literal["refuse", "skip"] = "refuse"
    """At an unreadable frame, or a time that does not increase: stop with an error, or skip and count it."""
    reading: tyro.conf.OmitArgPrefixes[ReadingArguments] = field(default_factory=ReadingArguments)

    def open(self, camera: "Camera | None" = None, with_notes: bool = True, tracked: bool = False) -> "Sequence":
        """Return the recording with the camera of the options, else with `camera`, else its own.

        tracked: whether a hand is to be tracked in it: colour that is not registered to the depth is left out, and
            depth that cannot be right is refused.
        with_notes: whether to print what the user must know about the recording, on standard error.

        Raises:
            InputError: if the recording or the camera of the options is unusable.
        """
        from depthtrack.recording import open_sequence
        from depthtrack.recording.depth_checks import check_depth

        chosen = self._chosen_camera()
        reading, given = self.reading.options, camera if chosen is None else chosen.camera
        if chosen is not None and not reading.distortion:
            reading = replace(reading, distortion=chosen.distortion)
        sequence = open_sequence(self.path, given, self.on_damage, reading)
        if tracked:
            check_depth(sequence)
        if tracked:
            sequence = with_registered_colour(
                sequence, lambda: open_sequence(self.path, given, self.on_damage, replace(reading, depth_only=True))
            )
        sequence.notes[:0] = () if chosen is None else chosen.notes
        if with_notes:
            print_notes(notes_of(sequence))
        return sequence

    def _chosen_camera(self) -> "CameraFile | None":
        """Return the camera that the options describe; None for the recording's own."""
        from depthtrack.geometry.camera import PRESETS, Camera
        from depthtrack.geometry.camera_files import CameraFile, read_camera
        from depthtrack.recording import image_size

        scale = self.reading.depth_scale
        numbers = {
            "fx": self.fx,
            "fy": self.fx if self.fy is None else self.fy,
            "cx": self.cx,
            "cy": self.cy,
            "depth_scale": scale,
        }
        given: dict[str, Any] = {name: number for name, number in numbers.items() if number is not None}
        if self.camera is not None and self.camera_preset is not None:
            raise InputError("--camera and --camera-preset exclude each other: give one of them")
        if self.camera is not None:
            file = read_camera(self.camera)
            notes = () if scale is not None else file.notes
            return replace(file, camera=replace(file.camera, **given), notes=notes)
        if self.camera_preset is not None:
            return CameraFile(replace(PRESETS[self.camera_preset], **given))
        if set(given) <= {"depth_scale"}:
            return None
        if self.fx is None or scale is None:
            raise InputError("a camera from numbers needs --fx and --depth-scale: give both, or a --camera-preset")
        width, height = image_size(self.path, self.reading.options)
        return CameraFile(Camera(width, height, **{"cx": (width - 1) / 2, "cy": (height - 1) / 2, **given}))

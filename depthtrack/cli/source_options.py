"""Options of the commands that track several recordings."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from depthtrack.cli.hand_options import HandOptions
from depthtrack.cli.reading_arguments import ReadingArguments
from depthtrack.cli.recording_notes import notes_of, print_notes, with_registered_colour
from depthtrack.cli.recording_options import PresetName
from depthtrack.cli.stated_default import number, stated_default
from depthtrack.errors import InputError

if TYPE_CHECKING:
    from depthtrack.evaluation.compare.running import Source


@dataclass(frozen=True)
class SourceOptions:
    """Frames to track, and the hand, skin colours and camera of all recordings."""

    frames: Annotated[int | None, number(1, 10**7, metavar="N")] = None
    """Track only the first N frames of each recording."""
    hands: tyro.conf.OmitArgPrefixes[HandOptions] = field(default_factory=HandOptions)
    skin_model: Annotated[Path | None, stated_default(metavar="FILE")] = None
    """Skin colour model from `depthtrack train-skin` (default: published statistics)."""
    camera: Annotated[Path | None, stated_default(metavar="FILE.json")] = None
    """Camera of recordings without one."""
    camera_preset: Annotated[PresetName | None, stated_default(metavar="kinect1|kinect2|realsense|tum")] = None
    """Nominal camera of a sensor, for recordings without one."""
    on_damage: Literal["refuse", "skip"] = "refuse"
    """At an unreadable frame, or a time that does not increase: stop with an error, or skip and count it."""
    reading: tyro.conf.OmitArgPrefixes[ReadingArguments] = field(default_factory=ReadingArguments)

    def source(self, path: Path) -> "Source":
        """Return the recording at `path` with these options.

        Raises:
            InputError: if two cameras or an unreadable one are given.
        """
        from depthtrack.evaluation.compare.running import Source
        from depthtrack.recording.hand_choice import AVERAGE, TRUTH

        hand = None if self.hands.hand == AVERAGE else self.hands.hand
        skin_model = self.skin_model
        camera, distortion = self._camera()
        reading = self.reading.options
        return Source(
            path=str(path.resolve()),
            camera=camera,
            on_damage=self.on_damage,
            hand=hand if hand in (None, TRUTH) else str(Path(hand).resolve()),
            skin_model=None if skin_model is None else str(skin_model.resolve()),
            frames=self.frames,
            side=self.hands.given_side,
            reading=reading if reading.distortion else replace(reading, distortion=distortion),
        )

    def checked(self, source: "Source") -> "Source":
        """Return a source without colour that is not registered, and print its notes.

        Raises:
            InputError: if the recording is unusable, or its depth cannot be right.
        """
        from depthtrack.recording.depth_checks import check_depth
        from depthtrack.recording.registry import reading_of

        depth_only = replace(source, reading=replace(source.reading, depth_only=True))
        opened = source.open()
        check_depth(opened)
        sequence = with_registered_colour(opened, depth_only.open)
        print_notes(notes_of(sequence))
        return replace(source, reading=reading_of(sequence))

    def with_side(self, source: "Source") -> "Source":
        """Return a source with the side of its hand, which is found if nothing states it.

        Raises:
            InputError: if the recording is unusable.
        """
        if source.hand is not None or source.side is not None:
            return source
        choice = self.hands.choose_side(source.open(), source.segmentation, frames=self.frames)
        return source if choice is None else replace(source, side=choice.side)

    def _camera(self) -> tuple[dict[str, Any] | None, tuple[float, ...]]:
        """Return the given camera as plain values, and its distortion. Raises InputError."""
        from dataclasses import asdict

        from depthtrack.geometry.camera import PRESETS
        from depthtrack.geometry.camera_files import read_camera

        if self.camera is not None and self.camera_preset is not None:
            raise InputError("--camera and --camera-preset exclude each other: give one of them")
        if self.camera is not None:
            file = read_camera(self.camera)
            return asdict(file.camera), file.distortion
        return (None if self.camera_preset is None else asdict(PRESETS[self.camera_preset])), ()

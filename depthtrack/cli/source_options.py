"""Options of the commands that track many recordings alike."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from depthtrack.cli.hand_options import HandOptions
from depthtrack.cli.recording_options import PresetName
from depthtrack.errors import InputError

if TYPE_CHECKING:
    from depthtrack.evaluation.compare.running import Source


@dataclass(frozen=True)
class SourceOptions:
    """How much of each recording to track, and what to know beside it."""

    frames: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """Only the first so many frames of each recording."""
    hands: tyro.conf.OmitArgPrefixes[HandOptions] = field(default_factory=HandOptions)
    skin_model: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Skin colours learnt by `depthtrack train-skin`; published statistics unless given."""
    camera: Annotated[Path | None, tyro.conf.arg(metavar="FILE.json")] = None
    """Camera of recordings that bring none."""
    camera_preset: Annotated[PresetName | None, tyro.conf.arg(metavar="kinect1|kinect2|realsense|tum")] = None
    """Nominal camera of a sensor instead."""
    on_damage: Literal["refuse", "skip"] = "refuse"
    """At a frame that cannot be read: stop with an error, or skip and count it."""

    def source(self, path: Path) -> "Source":
        """A recording with these options. Raises InputError."""
        from depthtrack.evaluation.compare.running import Source

        if self.frames is not None and self.frames < 1:
            raise InputError(f"--frames must be at least 1, found {self.frames}")
        hand, skin_model = self.hands.hand, self.skin_model
        return Source(
            path=str(path.resolve()),
            camera=self._camera(),
            on_damage=self.on_damage,
            hand=hand if hand in (None, "truth") else str(Path(hand).resolve()),
            skin_model=None if skin_model is None else str(skin_model.resolve()),
            frames=self.frames,
            side=self.hands.side,
        )

    def _camera(self) -> dict[str, Any] | None:
        from dataclasses import asdict

        from depthtrack.geometry.camera import PRESETS, Camera

        if self.camera is not None and self.camera_preset is not None:
            raise InputError("--camera and --camera-preset both name a camera: give one of them")
        if self.camera is not None:
            return asdict(Camera.from_json(self.camera))
        return None if self.camera_preset is None else asdict(PRESETS[self.camera_preset])

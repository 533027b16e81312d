"""`depthtrack synth`: a synthetic recording of a moving hand, with exact ground truth."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from depthtrack.cli.progress import bar
from depthtrack.errors import InputError

if TYPE_CHECKING:
    from depthtrack.hand.shape import HandShape


@dataclass(frozen=True)
class Command:
    """Synthesise a recording of a moving hand, with exact ground truth: poses, joints, hand mask and depth.

    Motions: everyday, grasp, other-grasps, signs, fast, random (any length), or a motion file of your own. The same
    options give the same bytes.
    """

    motion: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="MOTION")]
    """Name of a motion, or path of a .toml file like those in `sequences/`; `list` tells what there is."""
    out: Annotated[Path | None, tyro.conf.Positional, tyro.conf.arg(metavar="OUT")] = None
    """Folder to write; refused when it is there already, unless --overwrite."""

    sensor: Literal["ideal", "kinect1", "kinect2", "realsense"] = "ideal"
    """Depth camera to imitate: its image, noise, missing readings, shadows."""
    background: Literal["none", "wall", "room"] = "none"
    """What is behind the hand; the room is cluttered, with a face and other things of skin's colour."""
    model: Annotated[str, tyro.conf.arg(metavar="primitives|skin|RIG.glb")] = "primitives"
    """The hand: 37 spheres and cylinders, a smooth skin, or a rigged mesh (.glb, .gltf) with its own sizes."""
    forearm: Literal["auto", "on", "off"] = "auto"
    """With its bare forearm, which trackers must cut off; auto is on before a wall and in a room."""

    distance: Annotated[float | None, tyro.conf.arg(metavar="METRES")] = None
    """From the camera to the hand; 0.5 unless told, 0.65 for kinect2, which sees nothing nearer than 0.5."""
    viewpoint: Annotated[int, tyro.conf.arg(metavar="0..7")] = 0
    """Camera on the hemisphere around the hand: 0 frontal; 1-4 40 degrees to the right, above, left, below; 5-7 75
    degrees to the right, above, left."""
    frames: Annotated[int | None, tyro.conf.arg(metavar="COUNT")] = None
    """Only so many frames; how many, for the random motion (360)."""
    fps: Annotated[float, tyro.conf.arg(metavar="HZ")] = 30.0
    """Frames a second."""

    hand: Annotated[Path | None, tyro.conf.arg(metavar="HAND.JSON")] = None
    """Sizes of the hand (default: the average adult's)."""
    scale: float = 1.0
    """Factor on all sizes of the hand."""
    side: Annotated[Literal["right", "left"] | None, tyro.conf.arg(metavar="{right,left}")] = None
    """Right or left hand (default: the side of --hand or --model, or right). Of a rigged mesh, the hand to read."""

    depth_noise: Annotated[float, tyro.conf.arg(metavar="MM")] = 0.0
    """Add Gaussian noise of this deviation to the depth, on top of the sensor's."""
    skin_flips: Annotated[float, tyro.conf.arg(metavar="PERCENT")] = 0.0
    """Make this share of all pixels look like skin where there is none, and the other way round."""
    seed: int = 0
    """Chooses person, room, noise and random motion."""

    overwrite: bool = False
    """Replace the recording that OUT holds."""
    threads: int = 2
    """Workers; the result is the same for any number."""

    def run(self) -> None:
        if self.motion == "list" and self.out is None:
            print(_motions())
            return
        if self.out is None:
            raise InputError(f"say where to write: depthtrack synth {self.motion} OUT")
        if self.threads < 1:
            raise InputError(f"--threads must be at least 1, found {self.threads}")

        from depthtrack.synthesis.generate import Synthesis, Synthesiser, write_recording

        options = Synthesis(
            motion=self.motion,
            distance=self.distance,
            viewpoint=self.viewpoint,
            hand=self._hand(),
            model="primitives" if self.model == "primitives" else "skin",
            forearm={"auto": None, "on": True, "off": False}[self.forearm],
            background=self.background,
            sensor=self.sensor,
            depth_noise=self.depth_noise / 1000,
            skin_flips=self.skin_flips / 100,
            frames=self.frames,
            rate=self.fps,
            seed=self.seed,
        )
        made = Synthesiser(options)
        write_recording(
            made,
            self.out,
            overwrite=self.overwrite,
            threads=self.threads,
            progress=lambda frames: bar(frames, total=len(made)),
        )
        camera = made.sensor.camera
        print(
            f"{self.out}: {len(made)} frames of '{made.motion.name}', {camera.width}x{camera.height}"
            f" at {self.fps:g} Hz, a {options.hand.side} hand {made.distance:g} m before the {self.sensor} camera\n"
            f"look at it with  depthtrack view {self.out}"
        )

    def _hand(self) -> "HandShape":
        from depthtrack.hand.hand_file import is_rig, load_hand
        from depthtrack.hand.shape import HandShape

        if self.model in ("primitives", "skin"):
            shape = HandShape() if self.hand is None else load_hand(self.hand)
        elif not is_rig(Path(self.model)):
            raise InputError(f"--model must be primitives, skin or a .glb or .gltf file, found {self.model!r}")
        elif self.hand is not None:
            raise InputError("--hand and a rigged mesh as --model both give sizes: leave --hand out")
        else:
            shape = load_hand(Path(self.model), self.side)
        return shape.with_(scale=shape.scale * self.scale, side=self.side or shape.side)


def _motions() -> str:
    from depthtrack.synthesis.motion import load_motion
    from depthtrack.synthesis.motion_file import motion_names

    motions = [load_motion(name) for name in motion_names()]
    lengths = ["any length" if m.duration is None else f"{m.duration:g} s" for m in motions]
    return "\n".join(f"{m.name:<10} {length:<11} {m.about}" for m, length in zip(motions, lengths, strict=True))

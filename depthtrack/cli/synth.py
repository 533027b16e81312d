"""`depthtrack synth`: synthesise a recording of a moving hand with exact ground truth."""

from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from depthtrack.cli.argument_checks import Output
from depthtrack.cli.marker_options import MarkerOptions
from depthtrack.cli.progress import bar
from depthtrack.cli.stated_default import number, stated_default
from depthtrack.errors import InputError
from depthtrack.ranges import MOST_SEED

if TYPE_CHECKING:
    from depthtrack.hand.shape import HandShape


IMAGE_RATE = 30.0
"""Default number of images a second, Hz."""
_OF_BOTH = {"motion", "out", "frames", "fps", "hand", "scale", "side", "seed", "optical", "overwrite", "threads"}
"""Options of images and of markers."""


@dataclass(frozen=True)
class Command:
    """Synthesise a recording of a moving hand with exact ground truth.

    The ground truth has poses, joints, hand masks and depth. With --markers, it is an optical marker capture instead,
    and the ground truth has labels, positions and poses. The motions are everyday, grasp, other-grasps, signs, fast
    and random (any length), or your own motion file. The same options give the same bytes.
    """

    motion: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="MOTION")]
    """Name of a motion, or path of a .toml file like those in `sequences/`; `list` prints the names."""
    out: Annotated[Path | None, Output("recording"), tyro.conf.Positional, stated_default(metavar="OUT")] = None
    """Folder to write. An existing folder needs --overwrite."""

    sensor: Literal["ideal", "kinect1", "kinect2", "realsense"] = "ideal"
    """Depth camera to simulate: resolution, noise, missing readings, shadows."""
    background: Literal["none", "wall", "room"] = "none"
    """Background of the hand. The room is cluttered, with a face and other objects of skin colour."""
    model: Annotated[str, tyro.conf.arg(metavar="primitives|skin|RIG.glb")] = "primitives"
    """Hand to draw: 37 spheres and cylinders, a smooth skin, or a rigged mesh (.glb, .gltf) with its own sizes."""
    forearm: Literal["auto", "on", "off"] = "auto"
    """Draw the bare forearm, which a tracker must cut off. With auto it is drawn before a wall and in a room."""

    held_object: Literal["none", "sphere", "box", "cylinder"] = "none"
    """Object in the palm, of another colour than skin. It moves with the palm, and the fingers stop at it."""
    held_size: Annotated[float, number(1, 1000, metavar="MM")] = 60.0
    """Size of that object: the diameter of a sphere, the longest side of a box, 1.4 diameters of a cylinder."""
    distance: Annotated[float | None, number(0.05, 100, metavar="METRES")] = None
    """Camera-to-hand distance (default: 0.5, 0.65 for kinect2, or farther to keep the hand in the sensor's range)."""
    viewpoint: Annotated[int, number(0, 7, metavar="0..7")] = 0
    """Camera on the hemisphere around the hand: 0 is frontal; 1 to 4 are 40 degrees to the right, above, left, below; 5
    to 7 are 75 degrees to the right, above, left."""
    frames: Annotated[int | None, number(1, 10**7, metavar="COUNT")] = None
    """Number of frames (default: the whole motion; of the random one 360, or 5 s of markers)."""
    fps: Annotated[float | None, number(0.01, 10**4, metavar="HZ")] = None
    """Frames per second (default: 30, or 200 of markers)."""

    hand: Annotated[Path | None, stated_default(metavar="HAND.json")] = None
    """Sizes of the hand (default: the average adult's)."""
    scale: Annotated[float, number(0.1, 10)] = 1.0
    """Factor on all sizes of the hand."""
    side: Annotated[Literal["right", "left"] | None, stated_default(metavar="{right,left}")] = None
    """Side of the hand (default: that of --hand or --model, or right), or of the hand to read from a rigged mesh."""

    depth_noise: Annotated[float, number(0, 10**4, metavar="MM")] = 0.0
    """Standard deviation of Gaussian noise to add to the depth of the sensor."""
    skin_flips: Annotated[float, number(0, 100, metavar="PERCENT")] = 0.0
    """Share of the pixels whose skin label is inverted."""
    seed: Annotated[int, number(0, MOST_SEED)] = 0
    """Seed of the person, room, noise and random motion."""

    keypoints: bool = False
    """Write 2D keypoints too, as a detector finds them: `keypoints.csv`, for `track --keypoints`."""
    keypoint_noise: Annotated[float, number(0, 10**4, metavar="PIXELS")] = 3.0
    """Standard deviation of the keypoints."""
    missing_keypoints: Annotated[float, number(0, 100, metavar="PERCENT")] = 10.0
    """Share of the keypoints that are unknown."""
    swapped_fingers: Annotated[float, number(0, 100, metavar="PERCENT")] = 2.0
    """Share of the frames in which the keypoints of two neighbouring fingers are exchanged."""

    optical: tyro.conf.OmitArgPrefixes[MarkerOptions] = field(default_factory=MarkerOptions)

    overwrite: bool = False
    """Replace the recording in OUT."""
    threads: Annotated[int, number(1, 1024)] = 2
    """Number of threads. The result does not depend on it."""

    def run(self) -> None:
        if self.motion == "list" and self.out is None:
            print(_motions())
            return
        if self.out is None:
            raise InputError(f"expected a folder to write to: use  depthtrack synth {self.motion} OUT")
        if self.optical.is_unused:
            raise InputError("options of markers need a layout: give --markers, such as --markers 26")
        if self.optical.markers is not None:
            self._check_no_images()
            print(
                self.optical.write(
                    self.motion, self.out, self._hand(), self.frames, self.fps, self.seed, self.overwrite
                )
            )
        else:
            self._write_images(self.out)

    def _write_images(self, out: Path) -> None:
        from depthtrack.synthesis.generate import Synthesis, Synthesiser, write_recording
        from depthtrack.synthesis.keypoints import KeypointErrors

        errors = KeypointErrors(self.keypoint_noise, self.missing_keypoints / 100, self.swapped_fingers / 100)
        options = Synthesis(
            motion=self.motion,
            distance=self.distance,
            viewpoint=self.viewpoint,
            hand=self._hand(),
            model="primitives" if self.model == "primitives" else "skin",
            forearm={"auto": None, "on": True, "off": False}[self.forearm],
            background=self.background,
            sensor=self.sensor,
            held_object=self.held_object,
            held_size=self.held_size / 1000,
            depth_noise=self.depth_noise / 1000,
            skin_flips=self.skin_flips / 100,
            frames=self.frames,
            rate=IMAGE_RATE if self.fps is None else self.fps,
            seed=self.seed,
            keypoints=errors if self.keypoints else None,
        )
        made = Synthesiser(options)
        write_recording(
            made,
            out,
            overwrite=self.overwrite,
            threads=self.threads,
            progress=lambda frames: bar(frames, total=len(made)),
        )
        camera = made.sensor.camera
        print(
            f"{out}: {len(made)} frames of '{made.motion.name}', {camera.width}x{camera.height}"
            f" at {options.rate:g} Hz, a {options.hand.side} hand {made.distance:g} m before the {self.sensor} camera\n"
            f"show it with  depthtrack view {out}"
        )

    def _check_no_images(self) -> None:
        """Raise InputError if an option of images is given, which a marker capture has none of."""
        for option in fields(self):
            if option.name not in _OF_BOTH and getattr(self, option.name) != option.default:
                raise InputError(f"--{option.name.replace('_', '-')} is for images: leave it out with --markers")

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

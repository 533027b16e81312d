"""Options of `synth` for optical marker captures."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from depthtrack.cli.stated_default import number, stated_default
from depthtrack.errors import InputError

if TYPE_CHECKING:
    from depthtrack.hand.shape import HandShape

MARKER_RATE = 200.0
"""Default number of frames a second of a marker capture, Hz."""


@dataclass(frozen=True)
class MarkerOptions:
    """Optical markers in place of images (docs/marker-synthesis.md)."""

    markers: Annotated[str | None, stated_default(metavar="13|16|19|26|LAYOUT.json")] = None
    """Write an optical marker capture with this layout on the skin, in place of images."""
    two_hands: bool = False
    """Add the other hand, which moves through the motion backward."""
    touching: bool = False
    """Let two hands approach until they touch, every 2.5 seconds."""
    rigid_bodies: Annotated[int, number(0, 100)] = 0
    """Number of rigid bodies with markers below the hands."""
    rigid_markers: Annotated[int, number(3, 100)] = 4
    """Number of markers on each."""
    start: Annotated[float, number(0, 10**6, metavar="SECONDS")] = 0.0
    """Time in the motion of the first frame."""
    marker_noise: Annotated[float, number(0, 100, metavar="MM")] = 0.5
    """Standard deviation of the markers along each axis."""
    dropouts: Annotated[float, number(0, 100, metavar="PERCENT")] = 5.0
    """Share of the samples that are missing, in bursts."""
    bursts: Annotated[tuple[float, float], number(0, 3600, metavar="SECONDS SECONDS")] = (0.02, 0.25)
    """Shortest and longest burst."""
    ghosts: Annotated[int, number(0, 1000)] = 2
    """Number of ghosts in each frame: points near a marker for a short time."""
    incomplete_start: bool = False
    """Let markers be missing, and ghosts appear, in the first frame too."""
    size_spread: Annotated[float, number(0, 10)] = 1.0
    """Spread of the subject's hand sizes about those of the models, as a share of that among people."""
    placement: Annotated[float, number(0, 100, metavar="MM")] = 2.0
    """Standard deviation along each axis of the subject's markers about the layout."""
    capture: Literal["csv", "c3d", "trc"] = "csv"
    """Format of the capture."""

    @property
    def is_unused(self) -> bool:
        """Whether an option is given without a layout."""
        return self.markers is None and self != MarkerOptions()

    def write(
        self,
        motion: str,
        out: Path,
        hand: "HandShape",
        frames: int | None,
        rate: float | None,
        seed: int,
        overwrite: bool,
    ) -> str:
        """Write the capture and return a text on it.

        Raises:
            InputError: if an option is out of range, or the folder cannot be written.
        """
        from depthtrack.synthesis.marker_capture import MarkerSynthesis, synthesise_markers
        from depthtrack.synthesis.marker_folder import write_synthetic_markers
        from depthtrack.synthesis.marker_measurement import MeasurementErrors

        if self.markers is None:
            raise InputError("a marker capture needs a layout: give --markers")
        errors = MeasurementErrors(
            noise=self.marker_noise / 1000,
            dropouts=self.dropouts / 100,
            bursts=self.bursts,
            ghosts=self.ghosts,
            complete_start=not self.incomplete_start,
        )
        options = MarkerSynthesis(
            motion,
            self.markers,
            hand,
            two_hands=self.two_hands,
            touching=self.touching,
            rigid_bodies=self.rigid_bodies,
            rigid_markers=self.rigid_markers,
            start=self.start,
            frames=frames,
            rate=MARKER_RATE if rate is None else rate,
            size_spread=self.size_spread,
            placement=self.placement / 1000,
            errors=errors,
            seed=seed,
        )
        made = synthesise_markers(options)
        write_synthetic_markers(made, out, f".{self.capture}", overwrite)
        models = " ".join(str(out / "models" / f"{model.name}.json") for model in made.models)
        return (
            f"{out}: {len(made.capture)} frames of '{motion}' at {options.rate:g} Hz,"
            f" {sum(len(model.labels) for model in made.models)} markers on"
            f" {', '.join(model.name for model in made.models)}\n"
            f"models: {models}"
        )

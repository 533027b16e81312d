"""`depthtrack markers layout`: find where few markers on a hand show the most."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from depthtrack.cli.argument_checks import Output
from depthtrack.cli.stated_default import number, stated_default
from depthtrack.errors import InputError
from depthtrack.ranges import MOST_SEED, Range

if TYPE_CHECKING:
    from depthtrack.hand.shape import HandShape
    from depthtrack.markers.layout.options import LayoutOptions
    from depthtrack.markers.layout.quality import LayoutQuality, Terms
    from depthtrack.types import Array

MOST_POSTURES = 5000
"""Postures of a source that are used; more are thinned out."""


@dataclass(frozen=True)
class Command:
    """Find a layout of few markers for motions, and write where to stick them.

    The method is that of Schroeder, Maycock and Botsch 2015, by default with the expected error as the objective.
    Synergies and key-frames are those of the motions.
    LAYOUT.json serves as a model of `markers label`, `solve` and `fill`, and as a layout of `synth --markers`. The page
    beside it, LAYOUT.png, is to print.
    """

    motion: Annotated[tuple[str, ...], stated_default(metavar="MOTION ...")]
    """Motions by name, as grasp, motion files, or recorded postures: .mat, .csv, .npz, recordings and run folders."""
    markers: Annotated[int, number(1, 64, aliases=("-k",), metavar="K")]
    """Number of markers, without the one at the wrist."""
    out: Annotated[Path, Output("file", (".json",)), tyro.conf.arg(aliases=("-o",), metavar="LAYOUT.json")]
    """File to write."""
    hand: Annotated[Path | None, stated_default(metavar="HAND.json")] = None
    """Sizes of the hand (default: the average adult's)."""
    wrist: bool = True
    """Add a marker at the wrist, which gives the position of the hand. Without, the layout must give it."""
    objective: Literal["expected", "condition"] = "expected"
    """What the layout minimises: the expected error, or the condition number and distance of the paper."""
    components: Annotated[int | None, stated_default(Range(1, 20), metavar="COUNT")] = None
    """Synergies of the subspace (default: as many as markers, at most 6)."""
    key_frames: Annotated[int, number(1, 1000)] = 10
    """Postures that the layout is judged in."""
    robust: bool = False
    """Judge a layout after the loss of its worst marker."""
    cameras: Annotated[int | None, stated_default(Range(2, 64), metavar="COUNT")] = None
    """Number of cameras in a ring above the volume: prefer markers that two of them see (default: all are seen)."""
    radius: Annotated[float, number(0.5, 20, metavar="MM")] = 3.0
    """Radius of the markers."""
    noise: Annotated[float, number(0, 20, metavar="MM")] = 0.5
    """Standard deviation of each coordinate for the expected error."""
    seed: Annotated[int, number(0, MOST_SEED)] = 0
    """Seed of the search; the same seed gives the same layout."""
    json: bool = False
    """Print figures as JSON instead of text."""

    def run(self) -> None:
        from depthtrack.files import write_atomic
        from depthtrack.hand.hand_file import load_hand
        from depthtrack.hand.shape import HandShape
        from depthtrack.markers.layout.expected_error import expected_errors
        from depthtrack.markers.layout.instructions import instructions
        from depthtrack.markers.layout.search import find_layout_of
        from depthtrack.strict_data import json_text
        from depthtrack.viewing.contact_sheet import save_picture
        from depthtrack.viewing.layout_sheet import layout_sheet

        if not self.motion:
            raise InputError("a layout needs motions to show, as --motion grasp other-grasps")
        hand = HandShape() if self.hand is None else load_hand(self.hand)
        motions = [read_motion(name) for name in self.motion]
        options = self._options()
        quality = self._quality(hand, motions, options)
        found = find_layout_of(quality, self.markers, options, self.seed)
        about = f"{self.markers} markers for {', '.join(Path(name).name for name in self.motion)}"
        layout = replace(quality.candidates.layout(found.rows, about, self.wrist), synergies=quality.synergies)
        places, terms = instructions(layout, hand), quality.terms(found.rows)
        bare = quality.candidates.layout(found.rows, about).on(hand)
        errors = expected_errors(bare, motions, quality.options.components, self.wrist, self.noise / 1000)
        figures = self._figures(quality, terms) | {
            "error_mm": round(1000 * float(errors.mean.mean()), 3),
            "largest_mm": round(1000 * float(errors.largest.max()), 3),
        }
        page = self.out.with_suffix(".png")
        sentences = [f"{place.label}: {place.text}" for place in places]
        write_atomic(self.out, layout.to_json())
        save_picture(layout_sheet(layout.on(hand), about, sentences, _lines(figures)), page)
        if self.json:
            print(json_text({"layout": str(self.out), "page": str(page), "markers": sentences} | figures, indent=2))
        else:
            numbered = [f"{n:3}  {sentence}" for n, sentence in enumerate(sentences, start=1)]
            print("\n".join([*numbered, "", *_lines(figures), "", f"wrote {self.out} and {page}"]))

    def _options(self) -> "LayoutOptions":
        from depthtrack.markers.layout.options import FeasibleOptions, LayoutOptions, QualityOptions

        most = QualityOptions().components
        quality = QualityOptions(
            objective=self.objective,
            key_frames=self.key_frames,
            components=min(self.markers, most) if self.components is None else self.components,
            anchored=self.wrist,
            robust=self.robust,
        )
        return LayoutOptions(feasible=FeasibleOptions(radius=self.radius / 1000), quality=quality)

    def _quality(self, hand: "HandShape", motions: "list[Array]", options: "LayoutOptions") -> "LayoutQuality":
        import numpy as np

        from depthtrack.markers.layout.candidates import Candidates
        from depthtrack.markers.layout.occlusion import camera_directions, hidden_shares
        from depthtrack.markers.layout.quality import LayoutQuality

        candidates = Candidates.on_skin(hand, options.feasible)
        quality = LayoutQuality.of(candidates, np.concatenate(motions), options.quality)
        if self.cameras is None:
            return quality
        return quality.with_occlusion(hidden_shares(candidates, quality.postures, camera_directions(self.cameras)))

    def _figures(self, quality: "LayoutQuality", terms: "Terms") -> dict[str, Any]:
        return {
            "candidates": len(quality.candidates),
            "components": quality.options.components,
            "variance_share": round(quality.synergies.variance_share(quality.options.components), 4),
            "key_frames": len(quality.postures),
            "objective": self.objective,
            "energy": round(terms.energy, 6),
            "expected_rms_mm": round(1000 * terms.error, 3),
            "expected_rms_after_loss_mm": round(1000 * terms.error_lost, 3),
            "condition": round(terms.condition, 3),
            "condition_after_loss": round(terms.condition_lost, 1),
            "least_distance_mm": round(1000 * terms.distance, 2),
            "hidden_share": round(terms.occlusion, 4) if self.cameras is not None else None,
            "noise_mm": self.noise,
        }


def read_motion(name: str) -> "Array":
    """Return the postures (N, 20) of a motion by name or file, or of recorded postures.

    Raises:
        InputError: if there is neither.
    """
    import numpy as np

    from depthtrack.hand.pose import ANGLES
    from depthtrack.posture_databases.registry import read_postures
    from depthtrack.synthesis.motion import frame_times, load_motion
    from depthtrack.synthesis.motion_file import motion_names

    if name in motion_names() or name.endswith(".toml"):
        motion = load_motion(name)
        postures = motion.poses(frame_times(motion, 30.0, None), 0)[:, ANGLES]
    elif Path(name).exists():
        postures = read_postures(name).angles
    else:
        raise InputError(
            f"there is no motion '{name:.80}': give {', '.join(motion_names())}, a .toml file, or recorded postures"
        )
    return np.ascontiguousarray(postures[:: max(1, -(-len(postures) // MOST_POSTURES))])


def _condition(number: float) -> str:
    from depthtrack.markers.layout.condition import LARGEST

    return "infinite" if number >= 0.999 * LARGEST else f"{number:,.0f}"


def _lines(figures: dict[str, Any]) -> list[str]:
    hidden = figures["hidden_share"]
    return [
        f"{figures['components']} synergies with {100 * figures['variance_share']:.1f} % of the variance,"
        f" {figures['key_frames']} key-frames, {figures['candidates']} possible places",
        f"objective '{figures['objective']}' {figures['energy']:.3f}: expected root mean square error"
        f" {figures['expected_rms_mm']:.2f} mm, after the loss of the worst marker"
        f" {figures['expected_rms_after_loss_mm']:.2f} mm",
        f"condition number {_condition(figures['condition'])}, after the loss of the worst marker"
        f" {_condition(figures['condition_after_loss'])}, least distance {figures['least_distance_mm']:.1f} mm",
        *([] if hidden is None else [f"hidden from the cameras in {100 * hidden:.1f} % of the samples"]),
        f"simulated error with noise of {figures['noise_mm']:g} mm: {figures['error_mm']:.2f} mm mean of the skin,"
        f" {figures['largest_mm']:.1f} mm largest",
    ]

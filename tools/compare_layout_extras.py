"""Compare layouts that are robust to a loss, or seen by cameras, with usual ones.

    python tools/compare_layout_extras.py

The layouts are for `other-grasps`, and `grasp` is reconstructed from markers with noise of 0.5 mm each axis: from all,
and without each one of them. Cameras: a ring of eight.
"""

import numpy as np

from depthtrack.benchmarks.papers.schroeder2015 import motion_poses, training_postures
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.markers.layout.candidates import Candidates
from depthtrack.markers.layout.expected_error import VertexErrors
from depthtrack.markers.layout.occlusion import camera_directions, hidden_shares
from depthtrack.markers.layout.options import QualityOptions
from depthtrack.markers.layout.quality import LayoutQuality
from depthtrack.markers.layout.reconstruction import ReconstructionOptions, reconstruct
from depthtrack.markers.layout.search import find_layout_of
from depthtrack.types import Index

MARKERS = (4, 6, 8)
NOISE = 0.0005


def losses(quality: LayoutQuality, layout: Index) -> list[float]:
    """Return the mean errors, mm: of all markers, and without each one."""
    hand, truth = HandShape(), motion_poses("grasp")[::3]
    model, skin = quality.candidates.layout(layout, "layout").on(hand), Skin.of(hand)
    generator = np.random.default_rng(0)
    positions = model.positions(truth)
    positions = positions + generator.normal(0, NOISE, positions.shape)
    wrist = model.kinematics.wrist(truth)
    wrist = wrist + generator.normal(0, NOISE, wrist.shape)
    options, found = ReconstructionOptions(components=quality.options.components), []
    for lost in (None, *range(len(layout))):
        kept = np.array([k for k in range(len(layout)) if k != lost])
        poses = reconstruct(model.part(kept), positions[:, kept], quality.synergies, options, wrist)
        found.append(1000 * float(VertexErrors.between(skin, poses[::3], truth[::3]).mean.mean()))
    return found


def main() -> None:
    """Print the errors and the share of hidden samples."""
    candidates, postures = Candidates.on_skin(HandShape()), training_postures("grasps")
    for count in MARKERS:
        for name in ("usual", "robust", "cameras"):
            options = QualityOptions(components=min(6, count), robust=name == "robust")
            quality = LayoutQuality.of(candidates, postures, options)
            hidden = hidden_shares(candidates, quality.postures, camera_directions(8))
            judged = quality.with_occlusion(hidden) if name == "cameras" else quality
            layout = find_layout_of(judged, count, threads=1).rows
            terms, errors = quality.terms(layout), losses(quality, layout)
            print(
                f"{count} {name:8} expected {1000 * terms.error:.2f} mm, after the worst loss"
                f" {1000 * terms.error_lost:.2f} mm; reconstructed {errors[0]:.2f} mm, without one"
                f" {np.mean(errors[1:]):.2f} mm, without the worst {max(errors[1:]):.2f} mm;"
                f" hidden {100 * hidden[layout].mean():.1f} %",
                flush=True,
            )


if __name__ == "__main__":
    main()

"""Score hypotheses of a hand against an observation, as the swarm does: the true pose should have the lowest energy."""

import numpy as np

from depthtrack.hand.pose import retract
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.backends import create_scorer
from depthtrack.rendering.target import Target
from depthtrack.synthesis.generate import Synthesis, Synthesiser


def main(count: int = 1000, renderer: str = "raster") -> np.ndarray:
    """Energies (count,) of hypotheses ever farther from the truth, which is the first of them."""
    made = Synthesiser(Synthesis("everyday"))
    frame = made[30]
    rng = np.random.default_rng(0)
    # Metres for the position, radians for the rotation and the 20 finger angles.
    spread = np.repeat([0.02, 0.2, 0.3], [3, 3, 20]) * np.linspace(0, 1, count)[:, None]
    poses = retract(frame.pose, rng.standard_normal((count, 26)) * spread)
    with create_scorer(renderer, HandShape()) as scorer:
        scorer.set_target(Target(made.sensor.camera, frame.skin, frame.depth.astype(np.float32)))
        energies = scorer.score(poses)
    for part in np.array_split(energies, 5):
        print(f"{len(part)} hypotheses: energy {part.min():.1f} to {part.max():.1f}")
    return energies


if __name__ == "__main__":
    main()

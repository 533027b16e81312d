"""Hands of random sizes, drawn from their distribution among people."""

import numpy as np

from depthtrack.errors import InputError
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.size_parameters import SCALE, prior_covariance, resized


def random_hand(
    side: Side, scale: float | None, seed: int, share: float = 1.0, average: HandShape | None = None
) -> HandShape:
    """Return a hand with sizes drawn from their prior.

    scale: None to draw it too.
    share: factor on the differences from the average hand.
    average: None for the average adult's hand.

    Raises:
        InputError: if no draw gives sizes of a hand.
    """
    draw = np.random.Generator(np.random.Philox(key=[seed, 1 << 32]))
    for _ in range(100):
        values = draw.multivariate_normal(np.zeros(len(prior_covariance())), prior_covariance()) * share
        if scale is not None:
            values[SCALE] = np.log(scale)
        try:
            drawn = resized(HandShape() if average is None else average, values)
            return drawn.with_(side=side, source=f"drawn from the prior, seed {seed}", rig=None)
        except InputError:
            continue
    raise InputError(f"no hand of scale {scale} was drawn with seed {seed}: choose another seed")

"""Two hands side by side that may touch.

The right hand moves through a motion, and the left hand through the same one backward.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.synthesis.motion import Motion
from depthtrack.synthesis.scene_frame import mirrored
from depthtrack.types import Array

_APART = 0.1
"""Largest gap between hands, metres."""
_PERIOD = 2.5
"""Seconds from one touch to the next."""
_REACH = 0.1
"""Half the time over which the separation is smoothed, seconds."""
_NEAREST = 0.06
"""Smallest separation of the palms, metres, however the fingers pass each other."""
_PER_PHALANX, _PER_METACARPAL = 4, 5
_SAMPLES = 0.02
"""Seconds between the frames whose contact is computed; it is interpolated between them."""
_OTHER_SEED = 1 << 62
"""Difference of the seed of the left hand's random motion."""


def two_hand_poses(motion: Motion, hands: tuple[HandShape, HandShape], times: Array, seed: int, touch: bool) -> Array:
    """Return the poses (2, T, 27) of a right and a left hand, scene frame.

    times: (T,) evenly spaced, seconds.
    touch: whether the hands approach until they touch, every 2.5 seconds; else they stay 10 cm apart or more.
    """
    backward = times if motion.duration is None else motion.duration - times
    right = motion.poses(times, seed)
    left = mirrored(motion.poses(backward, seed ^ _OTHER_SEED))
    every = max(round(_SAMPLES / (times[1] - times[0])), 1) if len(times) > 1 else 1
    contact = np.interp(times, times[::every], _contact_separation(hands, right[::every], left[::every]))
    if touch and len(times) > 1:
        width = 2 * round(_REACH / (times[1] - times[0])) + 1
        # The average of maxima over windows that all hold a frame is at least the frame's own value.
        contact = uniform_filter1d(maximum_filter1d(contact, width, mode="nearest"), width, mode="nearest")
        gap = _APART / 2 * (1 + np.cos(2 * np.pi * (times - times[0]) / _PERIOD))
    else:
        contact, gap = np.full(len(times), contact.max()), np.full(len(times), _APART)
    poses = np.stack([right, left])
    poses[:, :, 0] += np.array([[-0.5], [0.5]]) * (contact + gap)
    return poses


def _contact_separation(hands: tuple[HandShape, HandShape], right: Array, left: Array) -> Array:
    """Return the shift (T,) of the left hand along x at which the hands begin to touch, metres."""
    (one, r1), (other, r2) = (_spheres(hand, poses) for hand, poses in zip(hands, (right, left), strict=True))
    reach = r1[:, None] + r2
    shift = right[:, 0] - left[:, 0] + _NEAREST
    for t, (a, b) in enumerate(zip(one, other, strict=True)):
        across = ((a[:, None, 1:] - b[:, 1:]) ** 2).sum(-1)
        meet = a[:, None, 0] - b[:, 0] + np.sqrt(np.maximum(reach**2 - across, 0))
        shift[t] = max(shift[t], np.max(meet, where=across < reach**2, initial=-np.inf))
    return shift


def _spheres(hand: HandShape, poses: ArrayLike) -> tuple[Array, Array]:
    """Return centres (T, N, 3) and radii (N,), metres, of spheres that fill a hand."""
    model, scale = HandModel(hand), hand.scale
    ends = model.endpoints(poses).reshape(-1, 5, 4, 3)
    t = np.linspace(0, 1, _PER_PHALANX, endpoint=False)[:, None]
    fingers = ends[:, :, :-1, None] * (1 - t) + ends[:, :, 1:, None] * t
    thick = (hand.radii[:, :-1, None] * (1 - t[:, 0]) + hand.radii[:, 1:, None] * t[:, 0]) * scale
    s = np.linspace(0.1, 1, _PER_METACARPAL, endpoint=False)[:, None]
    palm = model.wrist(poses)[:, None, None] * (1 - s) + ends[:, :, :1] * s
    half = np.full(palm.shape[1] * palm.shape[2], hand.palm_thickness / 2 * scale)
    centres = np.concatenate([fingers.reshape(len(ends), -1, 3), palm.reshape(len(ends), -1, 3)], axis=1)
    return centres, np.concatenate([thick.ravel(), half])

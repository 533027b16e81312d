"""Colours of the hand in one frame: of gloves, sleeves and unusual light."""

import numpy as np

from depthtrack.errors import InputError
from depthtrack.recording.sequence import Frame, Sequence
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.types import Mask

_ARM_REACH = 0.4
"""Distance from the palm within which pixels may be the arm, which is neither hand nor background, metres."""


def frame_for_skin(sequence: Sequence, index: int) -> Frame:
    """Return the frame of a recording that skin colours are taken from.

    Raises:
        InputError: the recording has no such frame, or it has no colour or cannot be read.
    """
    if not 0 <= index < len(sequence):
        raise InputError(f"--skin-from must be a frame from 0 to {len(sequence) - 1} of {sequence.name}, found {index}")
    frame = sequence[index]
    if frame.colour is None:
        raise InputError(f"--skin-from must be a frame with colour, found none in frame {index} of {sequence.name}")
    return frame


def skin_of_frame(frame: Frame, hand: Observation | None) -> SkinColourModel:
    """Return the colours of a hand in a frame.

    hand: as found by depth alone.

    Raises:
        InputError: no hand was found, or the frame shows nothing else.
    """
    if hand is None or frame.colour is None:
        raise InputError(
            f"--skin-from must be a frame whose hand is found by depth alone, found none in frame {frame.index}:"
            " take a frame with an open hand before a distant background"
        )
    mask = hand.whole_mask(frame.depth.shape)
    used = mask | ~_near(frame, hand)
    return SkinColourModel.train([(frame.colour[used][:, None], mask[used][:, None])])


def _near(frame: Frame, hand: Observation) -> Mask:
    """Return the readings (h, w) within an arm's reach of the palm."""
    v, u = np.indices(frame.depth.shape)
    points = frame.camera.unproject(np.stack([u, v], axis=-1), frame.depth)
    return np.asarray((frame.depth > 0) & (np.linalg.norm(points - hand.centre, axis=-1) < _ARM_REACH))

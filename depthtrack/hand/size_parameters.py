"""The sizes of a hand as 35 parameters: their prior, and the motion of the skin with them.

All are zero for the average adult's hand. Those of lengths, widths and the whole are logarithms of factors, so that
they stay positive and equal steps are equal ratios; the offsets of the base joints are metres in a hand of scale 1.
"""

import numpy as np

from depthtrack.hand.kinematics import HandModel, body_of
from depthtrack.hand.pose import FINGERS
from depthtrack.hand.shape import HandShape, Side
from depthtrack.types import Array, Index

SCALE = slice(0, 1)
LENGTHS = slice(1, 16)
WIDTHS = slice(16, 21)
PALM = slice(21, 24)
"""Factors on the palm's breadth, length and thickness; base joints move with breadth and length."""
KNUCKLES = slice(24, 32)
"""Offsets across and along the palm of the base joints of index to little finger."""
THUMB_BASE = slice(32, 35)
COUNT = 35

_SCALE_SPREAD = 0.10
"""Hand length varies by 6 % among adults (188 mm, standard deviation 12: Gordon et al., "1988 Anthropometric Survey of
U.S. Army Personnel", men and women together). Young people's hands are smaller still."""
_FINGER_SPREAD, _PHALANX_SPREAD = 0.05, 0.04
"""Finger lengths vary by 6 to 11 % (Chatzioglou, Pinar and Govsa, "Biometric analysis hand parameters in young adults",
Anat. Cell Biol. 57(2), 2024): beside those 6 %, by some 5 % of their own; and each phalanx by about as much again
(Buryanov and Kotiuk 2010: 8 to 15 % in all)."""
_WIDTHS_SPREAD, _WIDTH_SPREAD = 0.10, 0.04
"""All fingers together, by build, and each by itself: finger breadths vary by 8 to 9 % (Greiner 1991)."""
_PALM_SPREAD = (0.06, 0.06, 0.10)
"""Hand breadth varies by 8 %, men and women together (Gordon et al.), and partly correlates with length."""
_KNUCKLE_SPREAD, _THUMB_SPREAD = 0.003, 0.004
"""Metres; of the kind of the 3 mm by which metacarpals differ at the same hand length (Buryanov and Kotiuk 2010)."""


def hand_of(values: Array, side: Side, source: str = "") -> HandShape:
    """Return the hand of these sizes (35,).

    The displacement of its skin (NODES,) may follow them.

    Raises:
        InputError: if a size is outside the range of hands.
    """
    displacement = values[COUNT:] if len(values) > COUNT else None
    return resized(HandShape(), values[:COUNT]).with_(side=side, source=source, displacement=displacement)


def resized(hand: HandShape, values: Array) -> HandShape:
    """Return a hand with its sizes changed by `values` (35,).

    They refer to this hand as those of `hand_of` refer to the average one.

    Raises:
        InputError: if a size is outside the range of hands.
    """
    breadth, length, thickness = np.exp(values[PALM])
    bases = hand.bases * [breadth, length, 1.0]
    bases[1:, :2] += values[KNUCKLES].reshape(4, 2)
    bases[0] += values[THUMB_BASE]
    return hand.with_(
        scale=hand.scale * float(np.exp(values[0])),
        lengths=hand.lengths * np.exp(values[LENGTHS]).reshape(5, 3),
        radii=hand.radii * np.exp(values[WIDTHS])[:, None],
        bases=bases,
        palm_breadth=hand.palm_breadth * float(breadth),
        palm_length=hand.palm_length * float(length),
        palm_thickness=hand.palm_thickness * float(thickness),
        wrist_breadth=hand.wrist_breadth * float(breadth),
        wrist_thickness=hand.wrist_thickness * float(thickness),
    )


def prior_covariance() -> Array:
    """Return the covariance (35, 35) of the sizes among people; phalanges of a finger covary."""
    C = np.zeros((COUNT, COUNT))
    C[SCALE, SCALE] = _SCALE_SPREAD**2
    C[LENGTHS, LENGTHS] = np.kron(np.eye(5), np.full((3, 3), _FINGER_SPREAD**2)) + _PHALANX_SPREAD**2 * np.eye(15)
    C[WIDTHS, WIDTHS] = _WIDTHS_SPREAD**2 + _WIDTH_SPREAD**2 * np.eye(5)
    C[PALM, PALM] = np.diag(np.square(_PALM_SPREAD))
    C[KNUCKLES, KNUCKLES] = _KNUCKLE_SPREAD**2 * np.eye(8)
    C[THUMB_BASE, THUMB_BASE] = _THUMB_SPREAD**2 * np.eye(3)
    return C


def size_deviation(values: Array, covariance: Array) -> float:
    """Return the squared distance of sizes (35,) from the average ones.

    Its unit is a standard deviation.

    covariance: (35, 35) of the sizes.
    """
    return float(values @ np.linalg.solve(covariance, values))


def placement_covariance(joints: tuple[float, float, float], thickness: float) -> Array:
    """Return the covariance (35, 35) of sizes by the places of joints in the same flesh.

    joints: standard deviations of the places of a finger's three joints along it, metres in a hand of scale 1. A joint
        that moves outward lengthens the bone before it and shortens the one beyond.
    thickness: standard deviation of the logarithm of the palm's thickness.
    """
    average = HandShape()
    C = np.zeros((COUNT, COUNT))
    for finger in range(5):
        for joint, spread in enumerate(joints):
            shift = np.zeros(COUNT)
            shift[LENGTHS.start + 3 * finger + joint] = -1 / average.lengths[finger, joint]
            if joint > 0:
                shift[LENGTHS.start + 3 * finger + joint - 1] = 1 / average.lengths[finger, joint - 1]
            elif finger > 0:
                shift[KNUCKLES.start + 2 * (finger - 1) + 1] = 1.0
            else:
                shift[THUMB_BASE] = average.thumb_direction / np.linalg.norm(average.thumb_direction)
            C += spread**2 * np.outer(shift, shift)
    C[PALM.start + 2, PALM.start + 2] += thickness**2
    return C


def motion_of(model: HandModel, pose: Array, bodies: Index, points: Array) -> Array:
    """Return the derivative (N, 3, 35) of points on the skin by the sizes of `model`.

    bodies: (N,) body of each point.
    points: (N, 3) metres, camera frame.

    The skin stretches along its bone with the length, across it with the width, and
    moves with the bones before it. That is exact for bones and scale, and an approximation for flesh.
    """
    T, shape = model.transforms(pose), model.shape
    R, scale = T[0, :3, :3], shape.scale
    local = np.einsum("nji,nj->ni", T[bodies, :3, :3], points - T[bodies, :3, 3])
    J = np.zeros((len(points), 3, COUNT))
    J[:, :, 0] = points - T[0, :3, 3]
    on_palm = bodies == 0
    stretched = local[on_palm][:, None, :] * R
    J[on_palm, :, PALM] = stretched
    mirror = np.array([shape.mirror, 1.0, 1.0])
    average = HandShape()
    grown = average.bases * [shape.palm_breadth / average.palm_breadth, shape.palm_length / average.palm_length, 1.0]
    for finger in range(5):
        mine = (bodies > 3 * finger) & (bodies <= 3 * finger + 3)
        for phalanx in range(3):
            body, column = body_of(finger, phalanx), LENGTHS.start + 3 * finger + phalanx
            here, beyond = bodies == body, mine & (bodies > body)
            along = T[body, :3, 1]
            J[here, :, column] = local[here, 1:2] * along
            J[beyond, :, column] = model.lengths[finger, phalanx] * along
        across = local[mine] * [1.0, 0.0, 1.0]
        J[mine, :, WIDTHS.start + finger] = np.einsum("nij,nj->ni", T[bodies[mine], :3, :3], across)
        J[mine, :, PALM.start] = R @ (grown[finger] * [scale, 0, 0] * mirror)
        J[mine, :, PALM.start + 1] = R @ (grown[finger] * [0, scale, 0])
        if finger == 0:
            J[mine, :, THUMB_BASE] = R * mirror * scale
        else:
            first = KNUCKLES.start + 2 * (finger - 1)
            J[mine, :, first : first + 2] = (R * mirror * scale)[:, :2]
    return J


def measures(values: Array, reference: HandShape | None = None) -> dict[str, tuple[float, Array]]:
    """Return each length and width (m), and the gradient (35,) of its logarithm, by name.

    The hand length is from the wrist to the tip of the middle finger, a finger length from base joint to tip. A width
    is the diameter of the middle joint, or of the last joint of the thumb.

    reference: hand that the sizes refer to; the average one if None.
    """
    hand, table = resized(reference or HandShape(), values), {}
    lengths = hand.lengths * hand.scale
    palm = (hand.palm_length / 2 + hand.bases[2, 1]) * hand.scale
    whole = np.eye(COUNT)[0]
    whole[LENGTHS.start + 6 : LENGTHS.start + 9] = lengths[2] / (palm + lengths[2].sum())
    whole[PALM.start + 1] = palm / (palm + lengths[2].sum())
    whole[KNUCKLES.start + 3] = hand.scale / (palm + lengths[2].sum())
    table["hand_length"] = float(palm + lengths[2].sum()), whole
    for f, finger in enumerate(FINGERS):
        gradient = np.eye(COUNT)[0]
        gradient[LENGTHS.start + 3 * f : LENGTHS.start + 3 * f + 3] = lengths[f] / lengths[f].sum()
        table[f"{finger}_length"] = float(lengths[f].sum()), gradient
    for f, finger in enumerate(FINGERS):
        gradient = np.eye(COUNT)[0] + np.eye(COUNT)[WIDTHS.start + f]
        table[f"{finger}_width"] = float(2 * hand.radii[f, 2 if f == 0 else 1] * hand.scale), gradient
    for p, name in enumerate(("palm_breadth", "palm_length", "palm_thickness")):
        table[name] = float(getattr(hand, name) * hand.scale), np.eye(COUNT)[0] + np.eye(COUNT)[PALM.start + p]
    return table

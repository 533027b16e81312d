"""The 26 joints of OpenXR as a view of a pose: a frame and a radius each.

-Z of a joint's frame points along its bone to the fingertip. +Y points out of the back of the hand or of the nail, and
+X to the right of both. The frames of both hands are right-handed.

Source: the OpenXR Specification, extension XR_EXT_hand_tracking, "Conventions of hand joints".
"""

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.hand.kinematics import HandModel, body_of
from depthtrack.hand.pose import FINGERS
from depthtrack.hand.shape import HandShape
from depthtrack.types import Array

_THUMB_BONES = ("metacarpal", "proximal", "distal", "tip")
_FINGER_BONES = ("metacarpal", "proximal", "intermediate", "distal", "tip")
OPENXR_JOINTS = (
    "palm",
    "wrist",
    *(f"{finger}_{bone}" for finger in FINGERS for bone in (_THUMB_BONES if finger == "thumb" else _FINGER_BONES)),
)
"""The 26 joints in the order of `XrHandJointEXT`."""
OPENXR_PARENTS = (
    1,
    -1,
    *(1 if name.endswith("metacarpal") else joint - 1 for joint, name in enumerate(OPENXR_JOINTS) if joint > 1),
)
"""Index of the joint before each: a finger's joints in turn, its metacarpal and the palm after the wrist."""

R_BODY_JOINT: Array = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]])
"""OpenXR's axes in the frame of a body, whose y points along the bone and whose z points to the pad."""
_CARPUS = 27 / 92
"""Height of the carpus over the length of the palm (Youm et al. 1978, as in `hand.shape`)."""
_CARPAL_BREADTH = 0.5
"""Spread of the bases of the metacarpals over that of the knuckles: bones within 5 mm of published lengths."""


def openxr_transforms(model: HandModel, poses: ArrayLike) -> Array:
    """Return T_camera_joint (..., 26, 4, 4), metres, of poses (..., 27)."""
    bodies, T_body_joint = joint_frames(model.shape)
    return model.transforms(poses)[..., bodies, :, :] @ T_body_joint


def openxr_radii(shape: HandShape) -> Array:
    """Return the radius (26,) of each joint, metres.

    It is half the thickness of the hand at the joint. At a tip, which is on the skin, it is that of the pad.
    """
    palm, wrist = shape.palm_thickness / 2, shape.wrist_thickness / 2
    fingers = [[*([] if finger == 0 else [palm]), *shape.radii[finger]] for finger in range(5)]
    return np.array([palm, wrist, *(radius for radii in fingers for radius in radii)]) * shape.scale


def joint_frames(shape: HandShape) -> tuple[Array, Array]:
    """Return the body (26,) that each joint is fixed to, and T_body_joint (26, 4, 4), metres.

    The hand model has one rigid palm. The palm joint and the bases of the metacarpals are placed in it.
    """
    model = HandModel(shape)
    knuckles, wrist = model.base_transforms[:, :3, 3], shape.wrist
    bases = wrist + knuckles * [_CARPAL_BREADTH, 0, _CARPAL_BREADTH] + [0, _CARPUS * shape.palm_length * shape.scale, 0]
    middle = FINGERS.index("middle")
    bone = knuckles[middle] - bases[middle]
    frames = [(0, _palm_frame((bases[middle] + knuckles[middle]) / 2, bone))]
    frames.append((0, _palm_frame(wrist, bases[middle] - wrist)))
    for finger in range(5):
        if finger > 0:
            frames.append((0, _palm_frame(bases[finger], knuckles[finger] - bases[finger])))
        frames += [(body_of(finger, phalanx), _frame(R_BODY_JOINT, np.zeros(3))) for phalanx in range(3)]
        tip = np.array([0.0, model.lengths[finger, 2], 0.0])
        frames.append((body_of(finger, 2), _frame(R_BODY_JOINT, tip)))
    bodies, transforms = zip(*frames, strict=True)
    return np.array(bodies), np.stack(transforms)


def _palm_frame(origin: Array, forward: Array) -> Array:
    """Return T_palm_joint (4, 4) with -Z along `forward` (3,) and +Y out of the back."""
    back = -forward / np.linalg.norm(forward)
    up = np.array([0.0, 0.0, -1.0])
    up = up - back * (up @ back)
    up /= np.linalg.norm(up)
    return _frame(np.stack([np.cross(up, back), up, back], axis=-1), origin)


def _frame(rotation: Array, origin: Array) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation, origin
    return T

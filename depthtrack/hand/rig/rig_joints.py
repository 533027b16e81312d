"""Finger joints of a rig, found by their names and their place in the tree.

The tests cover these naming schemes.
- Blender's Rigify, MakeHuman: `thumb.01.R` and `f_index.01.R`, `finger2-1.R`.
- Unreal, Mixamo, VRM and Unity: `index_01_r`, `mixamorig:RightHandIndex1`, `rightIndexProximal`.
- Unity XR Hands, OpenXR and WebXR: `R_IndexProximal`, `index-finger-phalanx-proximal`.
- MediaPipe, Oculus, MANO: `INDEX_FINGER_MCP`, `b_r_index1`, `lindex0`.

The name gives the finger and the side. The last three joints of a finger except its tip
are its phalanges: a metacarpal, if the rig has one, comes before them.
"""

import re
from collections.abc import Mapping, Sequence

import numpy as np

from depthtrack.errors import InputError
from depthtrack.hand.kinematics import JOINT_NAMES
from depthtrack.hand.pose import FINGERS
from depthtrack.hand.shape import Side
from depthtrack.types import Array, Index

_FINGER_WORDS = (("thumb",), ("index", "forefinger"), ("middle",), ("ring",), ("little", "pinky", "pinkie"))
_PHALANX_WORDS = {"meta": 0, "carpal": 0, "prox": 1, "inter": 2, "medial": 2, "dist": 3}
_JOINT_WORDS = {"cmc": 0, "mcp": 1, "pip": 2, "ip": 3, "dip": 3}
_SIDE_WORDS: tuple[tuple[Side, str], ...] = (("left", "l"), ("right", "r"))
_TIP_WORDS = ("tip", "end", "nub", "null", "effector")
_NOT_A_HAND = ("toe", "foot", "leg")


def finger_joints(names: Sequence[str], parents: Index, loads: Array, side: Side | None) -> Index:
    """Return the joints (5, 3) of the phalanges, from the palm outward.

    `names`, `parents` (J,): the rig's joints.
    `loads` (J,): total skin weight of each joint; a fourth joint without weight is a tip.
    `side`: joints named for the other side are left out.

    Raises:
        InputError: if a finger has fewer than three joints, or if both hands are there and `side` is None.
    """
    sides = {s for name in names if finger_of(name) is not None and (s := side_of(name)) is not None}
    if side is None and len(sides) == 2:
        raise InputError("the rig holds both hands: give the one to read, side 'left' or 'right'")
    if side is not None and len(sides) == 1 and side not in sides:
        raise InputError(f"the rig must hold a {side} hand as asked, found a {sides.pop()} one: leave the side out")
    found = np.empty((5, 3), dtype=np.int64)
    missing = []
    for finger in range(5):
        chain = [
            j
            for j, name in enumerate(names)
            if finger_of(name) == finger and not _is_tip(name) and (side is None or side_of(name) in (None, side))
        ]
        chain.sort(key=lambda j: (_depth(parents, j), *_rank(names[j])))
        while len(chain) > 3 and loads[chain[-1]] == 0:
            chain.pop()
        if len(chain) < 3:
            missing.append(f"{FINGERS[finger]} ({len(chain)} joints)")
        else:
            found[finger] = chain[-3:]
    if missing:
        raise InputError(
            f"three joints a finger are needed, not found by name for: {', '.join(missing)}; give a mapping from "
            f"{JOINT_NAMES[1]}, ..., {JOINT_NAMES[-1]} to the rig's names in the file NAME.joints.json beside it; the "
            f"names are {_shortened(names)}"
        )
    return found


def mapped_joints(names: Sequence[str], mapping: Mapping[str, str]) -> Index:
    """Return the joints (5, 3) of the phalanges from a mapping of `JOINT_NAMES` to rig names.

    Raises:
        InputError: if a key is missing or unknown, or if the rig has no such joint.
    """
    wanted = JOINT_NAMES[1:]
    if unknown := sorted(set(mapping) - set(JOINT_NAMES)):
        raise InputError(f"the mapping must name only {', '.join(JOINT_NAMES)}; found {', '.join(unknown)}")
    if missing := [name for name in wanted if name not in mapping]:
        raise InputError(f"the mapping must name a joint for every phalanx; missing are {', '.join(missing)}")
    if absent := [str(joint) for joint in mapping.values() if joint not in names]:
        raise InputError(f"the rig has no joint {', '.join(absent)}; it has {_shortened(names)}")
    return np.array([names.index(mapping[name]) for name in wanted], dtype=np.int64).reshape(5, 3)


def finger_of(name: str) -> int | None:
    """Return the finger that a joint's name contains, 0 for the thumb; None for other joints."""
    text = name.lower()
    if any(word in text for word in _NOT_A_HAND):
        return None
    # "index-finger-middle" is a phalanx of the index finger: the first name counts.
    places = [(text.find(word), f) for f, words in enumerate(_FINGER_WORDS) for word in words if word in text]
    if places:
        return min(places)[1]
    numbered = re.search(r"finger[ _.-]?([1-5])(?!\d)", text)
    return int(numbered[1]) - 1 if numbered else None


def side_of(name: str) -> Side | None:
    """Return the side that a joint's name contains; None if it has none."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower()
    words = re.findall(r"[a-z]+", spaced)
    fingers = "|".join(word for words in _FINGER_WORDS for word in words)
    for side, letter in _SIDE_WORDS:
        glued = rf"(?:{side}|(?:^|[^a-z]){letter})_?(?:hand|{fingers})"
        if side in words or letter in words or re.search(glued, name.lower()):
            return side
    return None


def _is_tip(name: str) -> bool:
    words = re.findall(r"[a-z]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower())
    return any(word in words for word in _TIP_WORDS)


def _depth(parents: Index, joint: int) -> int:
    depth = 0
    while (joint := int(parents[joint])) >= 0:
        depth += 1
    return depth


def _rank(name: str) -> tuple[int, list[int], str]:
    """Return the key that sorts a finger's joints if the tree does not: by word, number, letter."""
    text = name.lower()
    words = re.findall(r"[a-z]+", text)
    anatomical = next((rank for word, rank in _JOINT_WORDS.items() if word in words), None)
    if anatomical is not None:
        return anatomical, [], text
    word = next((rank for word, rank in _PHALANX_WORDS.items() if word in text), 2 if "middle" in text[6:] else 0)
    return word, [int(number) for number in re.findall(r"\d+", text)], text


def _shortened(names: Sequence[str]) -> str:
    return ", ".join(names[:40]) + (" ..." if len(names) > 40 else "")

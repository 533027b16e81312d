"""The skeletons of public benchmarks: joints, their order in files, and cameras.

Source of orders and cameras: X. Chen, "awesome-hand-pose-estimation", evaluation/src, which collects published
predictions. The joints' positions were measured on its labels. ICVL's joints lie in the middle of the phalanges.
NYU's second joint of a finger lies at the middle knuckle. Its two wrist points lie beyond the wrist, 79 mm from the
palm's centre.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.hand.kinematics import KEYPOINT_NAMES
from depthtrack.hand.pose import FINGERS
from depthtrack.types import Array

Mixture = dict[str, float]
"""Keypoints and their weights, which sum to 1."""


@dataclass(frozen=True)
class Benchmark:
    """A benchmark's skeleton.

    camera: of the depth images.
    mixtures: the mixture of the 21 keypoints that gives each joint.
    source: the paper to cite.
    joints: (J,) names in the order of the files.
    """

    name: str
    camera: Camera
    mixtures: dict[str, Mixture]
    source: str
    joints: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "joints", tuple(self.mixtures))

    def from_keypoints(self, keypoints: ArrayLike) -> Array:
        """Return the benchmark's joints (..., J, 3) of keypoints (..., 21, 3), in their unit.

        A joint is NaN if one of its keypoints is.
        """
        weights = np.zeros((len(self.joints), len(KEYPOINT_NAMES)))
        for j, mixture in enumerate(self.mixtures.values()):
            for name, weight in mixture.items():
                weights[j, KEYPOINT_NAMES.index(name)] = weight
        points = np.asarray(keypoints, dtype=np.float64)
        unknown = (~np.isfinite(points)).astype(np.float64)
        mixed = np.einsum("jk,...kc->...jc", weights, np.nan_to_num(points))
        return np.where(np.einsum("jk,...kc->...jc", np.abs(weights), unknown) > 0, np.nan, mixed)

    def to_keypoints(self, joints: ArrayLike) -> Array:
        """Return the keypoints (..., 21, 3) of the benchmark's joints (..., J, 3).

        A keypoint is NaN if it is no joint of its own, but part of a mixture or of none.
        """
        points = np.asarray(joints, dtype=np.float64)
        keypoints = np.full((*points.shape[:-2], len(KEYPOINT_NAMES), 3), np.nan)
        for j, mixture in enumerate(self.mixtures.values()):
            if len(mixture) == 1:
                keypoints[..., KEYPOINT_NAMES.index(next(iter(mixture))), :] = points[..., j, :]
        return keypoints


def _same(*names: str) -> dict[str, Mixture]:
    return {name: {name: 1.0} for name in names}


def _middle(a: str, b: str) -> Mixture:
    return {a: 0.5, b: 0.5}


_PALM = _middle("wrist", "middle_mcp")


def _nyu() -> dict[str, Mixture]:
    """Return NYU's joints: fingers from little to index, thumb, both sides of the wrist, palm."""
    fingers = [_same(f"{finger}_tip", f"{finger}_pip") for finger in reversed(FINGERS[1:])]
    beyond = {"wrist": 1.45, "middle_mcp": -0.45}
    return {
        **{name: mixture for part in fingers for name, mixture in part.items()},
        **_same("thumb_tip", "thumb_ip", "thumb_mcp"),
        "wrist_ulnar": {**beyond, "little_mcp": 0.33, "index_mcp": -0.33},
        "wrist_radial": {**beyond, "little_mcp": -0.33, "index_mcp": 0.33},
        "palm": _PALM,
    }


def _icvl() -> dict[str, Mixture]:
    """Return ICVL's joints: the palm, then the middles of each finger's bones, thumb first."""
    bones: dict[str, Mixture] = {}
    for finger in FINGERS:
        points = [name for name in KEYPOINT_NAMES if name.startswith(f"{finger}_")]
        for bone, a, b in zip(("root", "middle", "end"), points[:3], points[1:], strict=True):
            bones[f"{finger}_{bone}"] = _middle(a, b)
    return {"palm": _PALM, **bones}


def _msra() -> dict[str, Mixture]:
    """Return MSRA's joints: the 21 keypoints with the thumb last."""
    order = [name for finger in (*FINGERS[1:], "thumb") for name in KEYPOINT_NAMES if name.startswith(f"{finger}_")]
    return _same("wrist", *order)


BENCHMARKS = {
    benchmark.name: benchmark
    for benchmark in (
        # NYU's own files have a negative vertical focal length, since their y points up; ours points down.
        Benchmark(
            "nyu",
            Camera(640, 480, 588.03, 587.07, 320.0, 240.0),
            _nyu(),
            "Tompson et al., Real-time continuous pose recovery of human hands, ACM Trans. Graphics 33(5), 2014",
        ),
        Benchmark(
            "icvl",
            Camera(320, 240, 240.99, 240.96, 160.0, 120.0),
            _icvl(),
            "Tang et al., Latent regression forest, CVPR 2014",
        ),
        Benchmark(
            "msra",
            Camera(320, 240, 241.42, 241.42, 160.0, 120.0),
            _msra(),
            "Sun et al., Cascaded hand pose regression, CVPR 2015",
        ),
    )
}


def find_benchmark(name: str) -> Benchmark:
    """Return a benchmark by its name.

    Raises:
        InputError: if there is no such benchmark.
    """
    if name not in BENCHMARKS:
        raise InputError(f"no benchmark '{name}': choose one of {', '.join(BENCHMARKS)}")
    return BENCHMARKS[name]

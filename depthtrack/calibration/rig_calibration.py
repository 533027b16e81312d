"""Measure the scale of a user's rigged hand on a recording.

The proportions are the rig's own, so scale is the only unknown besides the poses. Poses are searched with a few scales.
Then one scale minimises the depth disagreement of the rendered rig, its poses fitted to the point clouds anew.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from depthtrack.calibration.options import RigCalibrationOptions
from depthtrack.calibration.pose_search import PoseSearcher, Progress, ScorerFactory
from depthtrack.errors import InputError
from depthtrack.files import compact_json
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape, other_side
from depthtrack.rendering.hand_surface import HandSurface
from depthtrack.segmentation.observation import Observation
from depthtrack.solver.icp import IcpFitter
from depthtrack.solver.options import IcpOptions
from depthtrack.tracking.surfaces.registry import make_surface
from depthtrack.types import Array

_REACH = 0.15
"""Largest change of the logarithm of the scale after the search."""
_TOLERANCE = 0.002
"""Tolerance of the logarithm of the scale."""
_SUBSAMPLE = 3
"""Step between the fitted points."""
_CLIPPED = 0.04
"""Depth difference, metres, at which the cost of a pixel is clipped: d_M of Oikonomidis et al. 2011, Eq. 2."""


@dataclass(frozen=True)
class RigCalibration:
    """Rigged hand at the scale of a recording.

    `side_margin`: share by which the rig of the other side disagrees more, its poses fitted to the point clouds.
    `before`, `after`: mean disagreement (0 to 1) at the rig's own scale and at the measured one.
    `poses_before`, `poses` (V, 27): the poses at these scales in the `observations`, camera frame.
    """

    hand: HandShape
    side_margin: float
    before: float
    after: float
    observations: tuple[Observation, ...]
    poses_before: Array
    poses: Array

    def to_json(self) -> str:
        """Return the text of `hand.json`."""
        return compact_json(self.hand.to_fields())

    def summary(self) -> dict[str, Any]:
        """Return the figures as plain numbers."""
        return {
            "side": self.hand.side,
            "side_margin": self.side_margin,
            "scale": self.hand.scale,
            "views": len(self.observations),
            "disagreement_before": self.before,
            "disagreement_after": self.after,
        }


def calibrate_rig(
    observations: Sequence[Observation],
    rig: HandShape,
    scorer: ScorerFactory,
    seed: int = 0,
    source: str = "scaled",
    progress: Progress | None = None,
    options: RigCalibrationOptions | None = None,
) -> RigCalibration:
    """Return a rigged hand scaled to the hand in `observations`, the most open hands first.

    `scorer` makes the scorer of a hand. Equal observations, seed and energies give an equal hand.

    Raises:
        InputError: if `rig` refers to no rigged mesh, if the views show no hand, or if they show one of the other side.
    """
    from scipy.optimize import minimize_scalar

    if rig.rig is None:
        raise InputError("the hand to scale must be a rigged mesh (.glb, .gltf) or a hand file of one")
    show = progress or (lambda stage, share: None)
    options = options or RigCalibrationOptions()
    searcher = PoseSearcher(list(observations), scorer, seed, options)
    show("trying scales", 0.0)
    factor, own = _try_scales(searcher, rig, options)
    show("trying scales", 0.2)
    _, other = _try_scales(searcher, rig.with_(side=other_side(rig.side)), options)
    margin = other / own - 1
    if margin < -options.side_margin:
        raise InputError(
            f"the recording must show a {rig.side} hand like the rig, but the other side fits {-margin:.0%} better: "
            "give a rig of the other hand"
        )
    show("searching poses", 0.4)
    found = searcher.find(rig.with_(scale=rig.scale * factor), attempts=2)
    found.check_hand(options.accepted.hand_like)
    good = found.best(options.accepted.good_views)
    fit = _ScaleFit(rig, [searcher.observations[i] for i in good], found.poses[good])
    show("fitting the scale", 0.8)
    centre = np.log(factor)
    best = minimize_scalar(
        fit.disagreement, bounds=(centre - _REACH, centre + _REACH), method="bounded", options={"xatol": _TOLERANCE}
    )
    scale = round(rig.scale * float(np.exp(best.x)), 4)
    poses, after = fit.at(scale)
    poses_before, before = fit.at(rig.scale)
    show("done", 1.0)
    hand = rig.with_(scale=scale, source=f"{rig.source}, {source}")
    return RigCalibration(hand, margin, before, after, tuple(fit.observations), poses_before, poses)


def _try_scales(searcher: PoseSearcher, rig: HandShape, options: RigCalibrationOptions) -> tuple[float, float]:
    """Return the tried factor of the lowest energy, and the disagreement there.

    The poses found are fitted to the point clouds before.
    """
    tries = {f: searcher.find(rig.with_(scale=rig.scale * f), options.first) for f in options.tried_scales}
    factor = min(tries, key=lambda f: float(tries[f].energies.mean()))
    fit = _ScaleFit(rig, searcher.observations[: options.first], tries[factor].poses)
    return factor, fit.at(rig.scale * factor)[1]


class _ScaleFit:
    """Disagreement of a rig and the observations as a function of its scale."""

    def __init__(self, rig: HandShape, observations: list[Observation], poses: Array) -> None:
        self.observations, self._rig, self._poses = observations, rig, poses

    def disagreement(self, log_factor: float) -> float:
        """Return the mean disagreement at a scale relative to the rig's."""
        return self.at(self._rig.scale * float(np.exp(log_factor)))[1]

    def at(self, scale: float) -> tuple[Array, float]:
        """Return the fitted poses (V, 27) at a scale, and their mean disagreement."""
        shape = self._rig.with_(scale=scale)
        fitter = IcpFitter(shape, make_surface("skin", shape), IcpOptions(icp_iterations=8))
        surface = HandSurface.of(shape, skin=True)
        poses, costs = [], []
        for observation, pose in zip(self.observations, self._poses, strict=True):
            fitter.set_target(observation, _SUBSAMPLE)
            poses.append(fitter.fit(pose))
            costs.append(depth_disagreement(surface, observation, poses[-1]))
        return np.stack(poses), float(np.mean(costs))


def depth_disagreement(surface: HandSurface, observation: Observation, pose: Array) -> float:
    """Return the mean disagreement, 0 to 1, over the pixels of the hand in view or rendering.

    A pixel of only one of them counts 1. One of both counts the depth difference, clipped at 40 mm and relative to it,
    and nothing without a reading. Pixels below the wrist do not count: a rig and a segmentation end at different
    places there.
    """
    drawn, silhouette = surface.render(pose, observation.camera).depth, observation.silhouette > 0
    v, u = np.nonzero((drawn > 0) | silhouette)
    model, observed, is_hand = drawn[v, u], observation.depth[v, u], silhouette[v, u]
    points = observation.camera.unproject(np.stack([u, v], axis=-1), np.where(model > 0, model, observed))
    T_camera_palm = HandModel(surface.model.shape).transforms(pose)[0]
    height = (points - T_camera_palm[:3, 3]) @ T_camera_palm[:3, 1]
    counted = (height > surface.model.shape.wrist[1]) & ((model > 0) | (observed > 0))
    difference = np.minimum(np.abs(model - observed), _CLIPPED) / _CLIPPED
    cost = np.where((model > 0) & is_hand, np.where(observed > 0, difference, 0.0), 1.0)
    return float(cost[counted].mean()) if counted.any() else 1.0

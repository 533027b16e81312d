"""State of the tracked models and result of a frame, changed in place by kernels."""

from typing import NamedTuple

import numpy as np

from depthtrack.hand.limits import within_limits
from depthtrack.markers.labelling.options import LabellingOptions
from depthtrack.markers.labelling.scene import Scene
from depthtrack.types import Array, Index, Mask

NEVER = 1_000_000
"""Frames since a marker was seen that has not been seen yet."""


LARGEST_MARGIN, LARGEST_MISFIT = 20.0, 8.0
"""Limits of the features of a confidence: log-likelihood ratio, and standard deviations."""


class TrackState(NamedTuple):
    """What the next frame is predicted from: G models with M markers in all.

    active: (G,) whether the model is tracked.
    pose: (G, 27) of the last frame, capture frame.
    step: (G, 26) its change in the last frame.
    slope: (G, 20) of the joint limit function, see `SolverState`.
    error: (G,) mean residual of the last fits, metres.
    failing: (G,) frames in a row in which the model was getting lost.
    loose: (G,) frames in a row with fewer than three visible markers.
    undetermined: (G, 20) frames in a row in which an angle moved no visible marker.
    position, velocity: (M, 3) of each marker when last seen, m and m/frame.
    residual: (M, 3) metres, frame of the body: its distance from the model, kept while it is missing.
    missing: (M,) frames since it was seen.
    seen: (M,) frames in which it was seen.
    run: (M,) frames in a row in which it was seen.
    outlying: (M,) frames in a row with too large a residual.
    swap: (M, M) accumulated log-likelihood ratio of an exchange.
    """

    active: Mask
    pose: Array
    step: Array
    slope: Array
    error: Array
    failing: Index
    loose: Index
    undetermined: Index
    position: Array
    velocity: Array
    residual: Array
    missing: Index
    seen: Index
    run: Index
    outlying: Index
    swap: Array

    @staticmethod
    def empty(scene: Scene) -> "TrackState":
        """Return the state in which no model is tracked."""
        G, M = len(scene.rigid), len(scene.body)
        pose = np.zeros((G, 27))
        pose[:, 3] = 1.0
        return TrackState(
            np.zeros(G, np.bool_),
            pose,
            np.zeros((G, 26)),
            np.zeros((G, 20)),
            np.zeros(G),
            np.zeros(G, np.int64),
            np.zeros(G, np.int64),
            np.zeros((G, 20), np.int64),
            np.zeros((M, 3)),
            np.zeros((M, 3)),
            np.zeros((M, 3)),
            np.full(M, NEVER, np.int64),
            np.zeros(M, np.int64),
            np.zeros(M, np.int64),
            np.zeros(M, np.int64),
            np.zeros((M, M)),
        )

    def start(self, scene: Scene, g: int, pose: Array) -> None:
        """Track model g from a pose (27,); its markers have yet to be seen."""
        rows = slice(scene.first[g], scene.first[g + 1])
        self.active[g] = True
        self.pose[g] = within_limits(pose)
        if scene.rigid[g]:
            self.pose[g, 7:] = 0.0
        for array in (self.step, self.slope, self.error, self.failing, self.loose, self.undetermined):
            array[g] = 0
        for array in (self.position, self.velocity, self.residual, self.seen, self.run, self.outlying, self.swap):
            array[rows] = 0
        self.swap[:, rows] = 0
        self.missing[rows] = NEVER


class FrameLabels(NamedTuple):
    """Result of a frame.

    point: (M,) point of each marker; -1 if it has none.
    expected: (M, 3) position expected before the frame, metres.
    precision: (M, 3, 3) inverse of its covariance, 1/m^2.
    peak: (M,) logarithm of the normal density at the expected position, 1/m^3.
    score: (M,) log-likelihood ratio of the label against none.
    margin: (M,) by how much the next best explanation is worse.
    error: (M,) distance of the point from the fitted model, metres; NaN without a point.
    features: (M, 4) of the confidence, see `confidence.ONLINE`; NaN without a point.
    """

    point: Index
    expected: Array
    precision: Array
    peak: Array
    score: Array
    margin: Array
    error: Array
    features: Array

    @staticmethod
    def empty(count: int) -> "FrameLabels":
        """Return arrays for M markers."""
        return FrameLabels(
            np.full(count, -1, np.int64),
            np.full((count, 3), np.nan),
            np.full((count, 3, 3), np.nan),
            np.full(count, np.nan),
            np.full(count, np.nan),
            np.full(count, np.nan),
            np.full(count, np.nan),
            np.full((count, 4), np.nan),
        )


class Settings(NamedTuple):
    """The options of a frame as plain numbers; per frame instead of per second."""

    from_model: bool
    velocity_gain: float
    noise: float
    acceleration: float
    joint_drift: float
    joint_range: float
    determined: float
    palm_drift: float
    largest: float
    residual_gain: float
    familiar: int
    padded: bool
    distance_term: float
    clutter: float
    seen_again: float
    reappears: float
    reject: float
    reject_new: float
    patience: int
    swap: float
    iterations: int
    damping: float
    avoid_limits: bool
    freeze: bool
    least_spread: float
    robust: float
    least_share: float
    largest_error: float
    lost_frames: int
    retry_frames: int

    @staticmethod
    def of(options: LabellingOptions, rate: float) -> "Settings":
        """Return the settings for a frame rate, Hz."""
        p, a, f, lost, dt = options.prediction, options.assignment, options.fit, options.lost, 1 / rate
        return Settings(
            from_model=p.kind == "model",
            velocity_gain=p.velocity_gain,
            noise=p.noise,
            acceleration=p.acceleration * dt * dt,
            joint_drift=p.joint_speed * dt,
            joint_range=p.joint_range,
            determined=p.determined,
            palm_drift=p.palm_speed * dt,
            largest=p.largest,
            residual_gain=p.residual_gain,
            familiar=p.familiar,
            padded=a.padded,
            distance_term=a.distance_term,
            clutter=float(np.log(a.clutter)),
            seen_again=float(np.log(a.seen_again / (1 - a.seen_again))),
            reappears=float(np.log(a.reappears / (1 - a.reappears))),
            reject=a.reject,
            reject_new=a.reject_new,
            patience=a.patience,
            swap=a.swap,
            iterations=f.iterations,
            damping=f.damping,
            avoid_limits=f.avoid_limits,
            freeze=f.freeze,
            least_spread=f.least_spread,
            robust=f.robust,
            least_share=lost.least_share,
            largest_error=lost.largest_error,
            lost_frames=max(1, round(lost.seconds * rate)),
            retry_frames=max(1, round(lost.retry * rate)),
        )

"""Marker offsets and hand sizes from a labelled capture: joint estimation with priors.

Frames in different postures share offsets and sizes, and each has a pose of its own. The poses are eliminated from the
normal equations (Schur complement), as in `joint_optimisation`. The priors are those of hand sizes among people and of
marker positions about their layout. A calibrated model is the next layout: labelling with it corrects the labels.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from depthtrack.calibration.marker_equations import MarkerParameters, frame_energy, frame_equations
from depthtrack.calibration.options import MarkerCalibrationOptions
from depthtrack.errors import InputError
from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import ANGLES, retract
from depthtrack.hand.size_parameters import COUNT, measures, prior_covariance, resized
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.models.labelled_poses import fit_labelled_frame
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.markers.models.sized_fit import PosturePrior, SizedFitter
from depthtrack.solver.shared_parameters import eliminate_pose
from depthtrack.types import Array, Index

Labeller = Callable[[MarkerCapture, tuple[MarkerModel, ...]], LabelledCapture]
"""Labels a capture with models."""


@dataclass(frozen=True, eq=False)
class CalibratedMarkers:
    """A hand with the sizes and the offsets that its own capture shows.

    model: its spread is that of a marker about its place on the calibrated hand, skin motion included.
    values: (35,) sizes relative to those of the layout's hand, see `hand.size_parameters`.
    covariance: (35 + 3 M, 35 + 3 M) of sizes and offsets (m, body frames), given the capture and the priors.
    frames: (F,) frames used.
    before, after: root mean square distance of the markers from the layout's hand and from this one, metres.
    """

    model: MarkerModel
    values: Array
    covariance: Array
    frames: Index
    before: float
    after: float

    @property
    def offset_spread(self) -> Array:
        """The standard deviation (M, 3) of the offsets, metres, body frames."""
        return np.sqrt(np.diag(self.covariance)[COUNT:]).reshape(-1, 3)

    def sizes(self) -> dict[str, tuple[float, float]]:
        """Return each length and width with its standard deviation, metres, by name."""
        assert self.model.hand is not None
        C = self.covariance[:COUNT, :COUNT]
        named = measures(np.zeros(COUNT), self.model.hand)
        return {name: (size, size * float(np.sqrt(g @ C @ g))) for name, (size, g) in named.items()}


def calibrate_markers(
    labelled: LabelledCapture, k: int = 0, options: MarkerCalibrationOptions | None = None
) -> CalibratedMarkers:
    """Return the hand of model k of a labelled capture with its offsets and sizes.

    Poses that the capture lacks are fitted first. Samples of low confidence are left out. So are all of their frames if
    enough others remain: where one label is wrong, the label of its marker is on another point.

    Raises:
        InputError: if the model is a rigid body, or too few frames show enough markers.
    """
    options = options or MarkerCalibrationOptions()
    sure = labelled.confidence[k] >= options.least_confidence
    doubtful = np.any((labelled.columns[k] >= 0) & ~sure, axis=1)
    enough = max(options.least_share * sure.shape[1], 4)
    if np.count_nonzero(sure[~doubtful].sum(axis=1) >= enough) >= options.inspected:
        sure = sure & ~doubtful[:, None]
    positions = np.where(sure[..., None], labelled.positions(k), np.nan)
    return calibrate_on_positions(labelled.models[k], positions, labelled.poses[k], options)


def calibrate_on_positions(
    model: MarkerModel, positions: Array, poses: Array | None = None, options: MarkerCalibrationOptions | None = None
) -> CalibratedMarkers:
    """Return the hand with offsets and sizes of labelled positions.

    positions: (T, M, 3) metres, capture frame, NaN if not measured.
    poses: (T, 27), NaN if unknown.

    Raises:
        InputError: if the model is a rigid body, or too few frames show enough markers.
    """
    options = options or MarkerCalibrationOptions()
    if model.hand is None:
        raise InputError(f"'{model.name}' is a rigid body: only hands are calibrated, save it from its markers instead")
    fitter = SizedFitter(model, options.noise, PosturePrior.from_synergies(options.widening, options.residual))
    sample = _complete_frames(positions, options)
    known = np.full((len(sample), 27), np.nan) if poses is None else poses[sample]
    fits = [fit_labelled_frame(fitter, positions[f], pose) for f, pose in zip(sample, known, strict=True)]
    chosen = _different_frames(positions[sample], np.array([energy for _, energy in fits]), options)
    start = np.stack([fits[n][0] for n in chosen])
    return _estimate(fitter, positions[sample[chosen]], start, sample[chosen], options)


def self_calibrate(
    capture: MarkerCapture,
    models: tuple[MarkerModel, ...],
    label: Labeller,
    rounds: int = 2,
    options: MarkerCalibrationOptions | None = None,
) -> tuple[tuple[MarkerModel, ...], LabelledCapture]:
    """Return the models calibrated on an unlabelled capture, and its final labels.

    Each round labels with the models of the round before and calibrates the layouts on these labels.

    Raises:
        InputError: if too few frames show enough markers of a hand.
    """
    labelled = label(capture, models)
    for _ in range(rounds):
        current = tuple(
            model if model.is_rigid else calibrate_markers(replace(labelled, models=models), k, options).model
            for k, model in enumerate(models)
        )
        labelled = label(capture, current)
    return labelled.models, labelled


def _complete_frames(positions: Array, options: MarkerCalibrationOptions) -> Index:
    """Return frames (F,) with most of the markers, spread over the capture."""
    seen = np.isfinite(positions).all(axis=-1)
    usable = np.flatnonzero(seen.sum(axis=1) >= max(options.least_share * positions.shape[1], 4))
    if len(usable) < options.fewest:
        raise InputError(
            f"{len(usable)} frames show {options.least_share:.0%} of the markers, a calibration needs "
            f"{options.fewest}: check the labels, or fill the gaps first"
        )
    return usable[np.linspace(0, len(usable) - 1, min(len(usable), options.inspected)).round().astype(np.int64)]


def _different_frames(positions: Array, energies: Array, options: MarkerCalibrationOptions) -> Index:
    """Return the frames (F,) that differ most among those that a hand fits well.

    Wrong labels fit no hand.
    """
    good = np.argsort(energies, kind="stable")[: max(options.fewest, round(options.good_share * len(energies)))]
    shapes = _shape_features(positions[good])
    chosen = [int(np.argmin(np.isnan(shapes).sum(axis=1)))]
    nearest = np.full(len(good), np.inf)
    while len(chosen) < min(options.frames, len(good)):
        nearest = np.minimum(nearest, np.nan_to_num(np.nanmean((shapes - shapes[chosen[-1]]) ** 2, axis=1)))
        chosen.append(int(np.argmax(nearest)))
    return np.unique(good[chosen])


def _shape_features(positions: Array) -> Array:
    """Return the distances (T, M (M - 1) / 2) between the markers, metres."""
    rows, columns = np.triu_indices(positions.shape[1], 1)
    return np.asarray(np.linalg.norm(positions[:, rows] - positions[:, columns], axis=-1))


def _estimate(
    fitter: SizedFitter, points: Array, poses: Array, frames: Index, options: MarkerCalibrationOptions
) -> CalibratedMarkers:
    """Return offsets and sizes by damped Gauss-Newton with step halving on all frames."""
    model, parameters = fitter.model, MarkerParameters.of(fitter, options)
    values, poses = np.zeros(COUNT + 3 * len(model.labels)), within_limits(poses)
    prior = _prior_precision(model, options)
    damping = 1 / np.repeat(options.step_spread, [3, 3, 20]) ** 2
    kernel = options.kernel_scale
    before = _distances(parameters, values, poses, points)
    energy = _energy(parameters, prior, values, poses, points, kernel)
    for _ in range(options.iterations):
        systems = [frame_equations(parameters, values, p, x, kernel) for p, x in zip(poses, points, strict=True)]
        eliminated = [eliminate_pose(H, g, p[ANGLES], damping) for (H, g), p in zip(systems, poses, strict=True)]
        information = np.sum([e.information for e in eliminated], axis=0) + prior
        gradient = np.sum([e.gradient for e in eliminated], axis=0) + prior @ values
        change, length, gain = -np.linalg.solve(information, gradient), 1.0, 0.0
        for _ in range(options.halvings):
            tried = values + length * change
            steps = np.stack([length * (e.step + e.step_by_shared @ change) for e in eliminated])
            moved = within_limits(retract(poses, steps))
            trial = _energy(parameters, prior, tried, moved, points, kernel)
            gain = energy - trial
            if gain > 0:
                break
            length /= 2
        if not gain > 0:
            break
        values, poses, energy = tried, moved, trial
        if gain < options.tolerance * max(energy, 1.0):
            break
    after = _distances(parameters, values, poses, points)
    misfit = max(1.0, float(np.sqrt(np.nanmedian(after**2) / 3)) / options.noise)
    covariance = misfit**2 * np.linalg.inv(information)
    spread, seen = np.array(model.spread), np.isfinite(after).any(axis=0)
    spread[seen] = np.sqrt(options.noise**2 + np.nanmedian(after[:, seen] ** 2, axis=0) / 3)
    calibrated = model.with_(
        hand=resized(model.hand, values[:COUNT]).with_(source="calibrated on a marker capture"),  # type: ignore[arg-type]
        offsets=parameters.local(values),
        spread=spread,
        size_spread=np.minimum(np.sqrt(np.diag(covariance)[:COUNT]), 1.0),
    )
    return CalibratedMarkers(calibrated, values[:COUNT], covariance, frames, _rms(before), _rms(after))


def _prior_precision(model: MarkerModel, options: MarkerCalibrationOptions) -> Array:
    """Return the inverse covariance of sizes and offsets before the capture.

    Markers slip along the skin more than away from it. Away is where the offset points, the bone's direction aside.
    """
    n = COUNT + 3 * len(model.labels)
    P = np.zeros((n, n))
    P[:COUNT, :COUNT] = np.linalg.inv(prior_covariance())
    for i, (offset, spread) in enumerate(zip(model.offsets, model.spread, strict=True)):
        away = offset * [0.0, 0.0, 1.0] if model.bodies[i] == 0 else offset * [1.0, 0.0, 1.0]
        away = away / max(float(np.linalg.norm(away)), 1e-9)
        along, across = max(float(spread), 1e-4), max(float(spread) * options.across, 1e-4)
        rows = slice(COUNT + 3 * i, COUNT + 3 * i + 3)
        P[rows, rows] = np.eye(3) / along**2 + np.outer(away, away) * (1 / across**2 - 1 / along**2)
    return P


def _energy(
    parameters: MarkerParameters, prior: Array, values: Array, poses: Array, points: Array, kernel: float
) -> float:
    frames = [frame_energy(parameters, values, pose, x, kernel) for pose, x in zip(poses, points, strict=True)]
    return float(np.sum(frames) + 0.5 * values @ prior @ values)


def _distances(parameters: MarkerParameters, values: Array, poses: Array, points: Array) -> Array:
    """Return the distance (F, M) of the points from their markers, metres."""
    placed = np.stack([parameters.positions(values, pose) for pose in poses])
    return np.asarray(np.linalg.norm(placed - points, axis=-1))


def _rms(distances: Array) -> float:
    return float(np.sqrt(np.nanmean(distances**2)))

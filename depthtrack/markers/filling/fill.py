"""Fill the gaps of a labelled capture.

filled = fill_gaps(labelled)                                        # a LabelledCapture
filled = fill_gaps(labelled, FillOptions(method="paper", longest=0.5))
write_capture(path, filled.capture())
"""

from itertools import pairwise

import numpy as np

from depthtrack.markers.filled_capture import FilledCapture, Filling, Gap, measured_samples
from depthtrack.markers.filling.expected_error import error_after
from depthtrack.markers.filling.held_out import error_scale
from depthtrack.markers.filling.options import FillOptions
from depthtrack.markers.filling.paper_fill import paper_fill
from depthtrack.markers.filling.pattern_fill import pattern_fill
from depthtrack.markers.filling.pca_fill import pca_fill
from depthtrack.markers.filling.prediction import Prediction, gaps_to_fill, time_to_measured
from depthtrack.markers.filling.smooth_fill import smooth_fill
from depthtrack.markers.filling.spline_fill import spline_fill
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.types import Array, Mask

_FILLING = {"spline": Filling.SPLINE, "pattern": Filling.PATTERN, "pca": Filling.PCA}


def fill_gaps(labelled: LabelledCapture, options: FillOptions | None = None) -> FilledCapture:
    """Return the capture with its gaps filled.

    Measured samples stay as they are, except those that the method of the paper rejects (`Filling.REPLACED`).
    Gaps over `longest`, those at the ends unless `ends`, and those that the method cannot fill stay NaN.
    """
    options = options or FillOptions()
    rate = labelled.capture.rate
    measured = [labelled.positions(k) for k in range(len(labelled.models))]
    visible = [measured_samples(positions) for positions in measured]
    gaps = [gaps_to_fill(k, seen, rate, options) for k, seen in enumerate(visible)]
    predictions = _predictions(labelled, measured, gaps, options)
    merged = [_merged(*each) for each in zip(measured, visible, gaps, predictions, strict=True)]
    positions, how, error, poses = (tuple(parts) for parts in zip(*merged, strict=True))
    return FilledCapture(labelled, positions, how, error, poses)


def _predictions(
    labelled: LabelledCapture, measured: list[Array], gaps: list[list[Gap]], options: FillOptions
) -> list[Prediction]:
    """Return what the method gives for each model."""
    rate, method = labelled.capture.rate, options.method
    given = list(zip(labelled.models, measured, labelled.poses, gaps, strict=True))
    if method == "smooth":
        return [smooth_fill(model, X, poses, some, rate, options.smooth) for model, X, poses, some in given]
    if method == "paper":
        return [paper_fill(model, X, poses, rate, options.paper) for model, X, poses, _ in given]

    def fill(measured: list[Array], gaps: list[list[Gap]]) -> list[Array]:
        if method == "pca":
            return _pca(labelled, measured, gaps, options)
        each = zip(measured, gaps, strict=True)
        if method == "pattern":
            return [pattern_fill(X, some, options.pattern) for X, some in each]
        return [spline_fill(X, some) for X, some in each]

    scale = error_scale(fill, method, measured, gaps, rate)
    errors = [scale * error_after(method, time_to_measured(measured_samples(X), rate)) for X in measured]
    how = int(_FILLING[method])
    return [
        Prediction(positions, np.full(error.shape, how), error, poses)
        for positions, error, poses in zip(fill(measured, gaps), errors, labelled.poses, strict=True)
    ]


def _pca(labelled: LabelledCapture, measured: list[Array], gaps: list[list[Gap]], options: FillOptions) -> list[Array]:
    """Return the gaps (T, M, 3) of each model, filled by principal components."""
    used = {int(column) for columns in labelled.columns for column in np.unique(columns)}
    others = [c for c in np.flatnonzero(labelled.capture.is_labelled) if int(c) not in used]
    everything = np.concatenate([*measured, labelled.capture.positions[:, others]], axis=1)
    ends = np.cumsum([0, *(positions.shape[1] for positions in measured)])
    shifted = [gap._replace(marker=gap.marker + int(ends[gap.model])) for some in gaps for gap in some]
    filled = pca_fill(everything, shifted, options.pca)
    return [filled[:, start:stop] for start, stop in pairwise(ends)]


def _merged(
    measured: Array, visible: Mask, gaps: list[Gap], prediction: Prediction
) -> tuple[Array, Array, Array, Array]:
    """Return positions, how, expected error and poses of a model."""
    asked = np.zeros(visible.shape, dtype=np.bool_)
    for gap in gaps:
        asked[gap.start : gap.stop, gap.marker] = True
    replaced = visible & (prediction.how == Filling.REPLACED)
    filled = (asked | replaced) & np.isfinite(prediction.positions).all(axis=-1)
    how = np.where(visible, int(Filling.MEASURED), int(Filling.GAP))
    how = np.where(filled, prediction.how, how)
    positions = np.where(filled[..., None], prediction.positions, measured)
    return positions, how, np.where(filled, prediction.expected_error, np.nan), prediction.poses

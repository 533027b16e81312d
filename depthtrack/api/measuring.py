"""Measure hands on recordings."""

from functools import partial

from depthtrack.api.choices import Hand, Recording, open_hand, to_track
from depthtrack.calibration.calibrate import Calibration
from depthtrack.calibration.calibrate import calibrate as calibrate_side
from depthtrack.calibration.options import CalibrationOptions
from depthtrack.calibration.pose_search import Progress, ScorerFactory
from depthtrack.calibration.rig_calibration import RigCalibration
from depthtrack.calibration.rig_calibration import calibrate_rig as calibrate_rig_on_views
from depthtrack.calibration.sides import calibrate_either_side
from depthtrack.calibration.views import choose_views
from depthtrack.hand.shape import Side
from depthtrack.machine import usable_cores
from depthtrack.recording.sequence import Sequence
from depthtrack.rendering.raster import RasterScorer
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.segmentation.segmenter import Segmenter


def calibrate(
    recording: Recording,
    side: Side | None = None,
    *,
    segmentation: SegmentationOptions | None = None,
    seed: int = 0,
    threads: int | None = None,
    frames: int | None = None,
    progress: Progress | None = None,
    options: CalibrationOptions | None = None,
) -> Calibration:
    """Measure the hand of a recording: side, scale, fingers and palm.

    Best on a few seconds of one bare hand that turns, opens and closes.

    side: "right" or "left"; if absent, both are tracked over the recording, and the one that fits better is kept.
    segmentation: how the hand is found in a frame.
    seed: equal seeds give equal hands.
    threads: threads of the renderer, one per core if absent; the hand does not depend on it.
    frames: number of first frames to use; all if absent.
    progress: called with the current stage and the share of the work that is done.
    options: rounds and weights; `CalibrationOptions(skin_rounds=0)` measures the sizes alone.

    Raises:
        InputError: the recording does not show a hand well enough.

    Example:
        calibration = depthtrack.calibrate("my-hand")
        Path("hand.json").write_text(calibration.to_json())
        depthtrack.track("my-hand", calibration.hand, out="my-run")
    """
    sequence = to_track(recording)
    threads = threads or usable_cores()
    if side is None:
        return calibrate_either_side(sequence, segmentation, seed, threads, frames, progress, options)
    return calibrate_side(sequence, side, (), segmentation, seed, threads, frames, progress, options)


def calibrate_rig(
    recording: Recording,
    rig: Hand,
    *,
    segmentation: SegmentationOptions | None = None,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> RigCalibration:
    """Measure the scale of a rigged hand on a recording.

    The other arguments are those of `calibrate`.

    rig: path of a rigged mesh (.glb, .gltf), or a hand that refers to one.

    Raises:
        InputError: `rig` is no rigged mesh, or the recording does not show such a hand.

    Example:
        calibration = depthtrack.calibrate_rig("my-hand", "hand.glb")
        print(calibration.hand.scale)
    """
    sequence, hand = to_track(recording), open_hand(rig)
    views = _views(sequence, segmentation, progress)
    return calibrate_rig_on_views(views, hand, _scorers(threads), seed, f"scaled on {sequence.name}", progress)


def _views(
    sequence: Sequence, segmentation: SegmentationOptions | None, progress: Progress | None
) -> list[Observation]:
    """Return the observations to calibrate on."""
    if progress is not None:
        progress("choosing frames", 0.0)
    return choose_views(sequence, Segmenter.for_sequence(sequence, segmentation))


def _scorers(threads: int | None) -> ScorerFactory:
    return partial(RasterScorer, threads=threads or usable_cores())

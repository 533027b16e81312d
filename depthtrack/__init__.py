"""Full 26-degree-of-freedom hand tracking from RGB-D video on an ordinary CPU.

All names below are loaded at first use, so that `import depthtrack` takes no time.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from depthtrack.api.choices import open_hand as open_hand
    from depthtrack.api.choices import open_recording as open_recording
    from depthtrack.api.comparing import compare as compare
    from depthtrack.api.comparing import comparison_table as comparison_table
    from depthtrack.api.lifting import lift as lift
    from depthtrack.api.live import HandTracker as HandTracker
    from depthtrack.api.markers import evaluate_markers as evaluate_markers
    from depthtrack.api.markers import fill_markers as fill_markers
    from depthtrack.api.markers import label_markers as label_markers
    from depthtrack.api.markers import read_marker_folder as read_marker_folder
    from depthtrack.api.markers import solve_markers as solve_markers
    from depthtrack.api.measuring import calibrate as calibrate
    from depthtrack.api.measuring import calibrate_rig as calibrate_rig
    from depthtrack.api.runs import evaluate as evaluate
    from depthtrack.api.runs import export_run as export_run
    from depthtrack.api.runs import joint_track as joint_track
    from depthtrack.api.runs import read_run as read_run
    from depthtrack.api.runs import track as track
    from depthtrack.api.synthetic import synthesise as synthesise
    from depthtrack.api.synthetic import synthesise_markers as synthesise_markers
    from depthtrack.calibration.calibrate import Calibration as Calibration
    from depthtrack.calibration.marker_solution import MarkerSolution as MarkerSolution
    from depthtrack.calibration.rig_calibration import RigCalibration as RigCalibration
    from depthtrack.errors import DepthtrackError as DepthtrackError
    from depthtrack.errors import InputError as InputError
    from depthtrack.evaluation.evaluate import Evaluation as Evaluation
    from depthtrack.evaluation.marker_evaluation import MarkerEvaluation as MarkerEvaluation
    from depthtrack.evaluation.metrics.metric import Metric as Metric
    from depthtrack.export.joint_track import JointTrack as JointTrack
    from depthtrack.export.registry import EXPORTERS as EXPORTERS
    from depthtrack.geometry.camera import Camera as Camera
    from depthtrack.hand.kinematics import KEYPOINT_NAMES as KEYPOINT_NAMES
    from depthtrack.hand.kinematics import HandModel as HandModel
    from depthtrack.hand.one_euro import OneEuroFilter as OneEuroFilter
    from depthtrack.hand.one_euro import OneEuroOptions as OneEuroOptions
    from depthtrack.hand.shape import HandShape as HandShape
    from depthtrack.hand.synergies import Synergies as Synergies
    from depthtrack.live.frame_queue import queue_frames as queue_frames
    from depthtrack.live.frames import LiveFrame as LiveFrame
    from depthtrack.live.frames import LiveSource as LiveSource
    from depthtrack.live.late_frames import LateFrames as LateFrames
    from depthtrack.live.played_recording import PlayedRecording as PlayedRecording
    from depthtrack.live.realsense import RealSenseSource as RealSenseSource
    from depthtrack.live.tracking import LiveEstimate as LiveEstimate
    from depthtrack.live.tracking import LiveReport as LiveReport
    from depthtrack.live.tracking import track_live as track_live
    from depthtrack.markers.capture import MarkerCapture as MarkerCapture
    from depthtrack.markers.filled_capture import FilledCapture as FilledCapture
    from depthtrack.markers.filling.options import FillOptions as FillOptions
    from depthtrack.markers.formats.registry import read_capture as read_capture
    from depthtrack.markers.formats.registry import write_capture as write_capture
    from depthtrack.markers.labelled_capture import LabelledCapture as LabelledCapture
    from depthtrack.markers.labelling.options import LabellingOptions as LabellingOptions
    from depthtrack.markers.models.marker_model import MarkerModel as MarkerModel
    from depthtrack.recording.run_folder import Run as Run
    from depthtrack.recording.sequence import Frame as Frame
    from depthtrack.recording.sequence import GroundTruth as GroundTruth
    from depthtrack.recording.sequence import ImageKeypoints as ImageKeypoints
    from depthtrack.recording.sequence import Sequence as Sequence
    from depthtrack.recording.status import Status as Status
    from depthtrack.rendering.backends import create_scorer as create_scorer
    from depthtrack.segmentation.observation import Observation as Observation
    from depthtrack.segmentation.options import SegmentationOptions as SegmentationOptions
    from depthtrack.synthesis.generate import Synthesis as Synthesis
    from depthtrack.synthesis.marker_capture import MarkerSynthesis as MarkerSynthesis
    from depthtrack.synthesis.marker_capture import SyntheticMarkers as SyntheticMarkers
    from depthtrack.synthesis.marker_measurement import MeasurementErrors as MeasurementErrors
    from depthtrack.tracking.backward_options import BackwardOptions as BackwardOptions
    from depthtrack.tracking.pipeline import TrackedFrame as TrackedFrame
    from depthtrack.tracking.registry import tracker_config as tracker_config
    from depthtrack.tracking.tracker import Estimate as Estimate

_MODULES = {
    "api.choices": ("open_hand", "open_recording"),
    "api.comparing": ("compare", "comparison_table"),
    "api.lifting": ("lift",),
    "api.live": ("HandTracker",),
    "api.markers": ("evaluate_markers", "fill_markers", "label_markers", "read_marker_folder", "solve_markers"),
    "api.measuring": ("calibrate", "calibrate_rig"),
    "api.runs": ("evaluate", "export_run", "joint_track", "read_run", "track"),
    "api.synthetic": ("synthesise", "synthesise_markers"),
    "calibration.calibrate": ("Calibration",),
    "calibration.marker_solution": ("MarkerSolution",),
    "calibration.rig_calibration": ("RigCalibration",),
    "errors": ("DepthtrackError", "InputError"),
    "evaluation.evaluate": ("Evaluation",),
    "evaluation.marker_evaluation": ("MarkerEvaluation",),
    "evaluation.metrics.metric": ("Metric",),
    "export.joint_track": ("JointTrack",),
    "export.registry": ("EXPORTERS",),
    "geometry.camera": ("Camera",),
    "hand.kinematics": ("KEYPOINT_NAMES", "HandModel"),
    "live.frame_queue": ("queue_frames",),
    "live.late_frames": ("LateFrames",),
    "live.frames": ("LiveFrame", "LiveSource"),
    "live.played_recording": ("PlayedRecording",),
    "live.realsense": ("RealSenseSource",),
    "live.tracking": ("LiveEstimate", "LiveReport", "track_live"),
    "hand.one_euro": ("OneEuroFilter", "OneEuroOptions"),
    "hand.shape": ("HandShape",),
    "hand.synergies": ("Synergies",),
    "markers.capture": ("MarkerCapture",),
    "markers.formats.registry": ("read_capture", "write_capture"),
    "markers.filled_capture": ("FilledCapture",),
    "markers.filling.options": ("FillOptions",),
    "markers.labelled_capture": ("LabelledCapture",),
    "markers.labelling.options": ("LabellingOptions",),
    "markers.models.marker_model": ("MarkerModel",),
    "recording.run_folder": ("Run",),
    "recording.sequence": ("Frame", "GroundTruth", "ImageKeypoints", "Sequence"),
    "recording.status": ("Status",),
    "rendering.backends": ("create_scorer",),
    "segmentation.observation": ("Observation",),
    "segmentation.options": ("SegmentationOptions",),
    "synthesis.generate": ("Synthesis",),
    "synthesis.marker_capture": ("MarkerSynthesis", "SyntheticMarkers"),
    "synthesis.marker_measurement": ("MeasurementErrors",),
    "tracking.backward_options": ("BackwardOptions",),
    "tracking.pipeline": ("TrackedFrame",),
    "tracking.registry": ("tracker_config",),
    "tracking.tracker": ("Estimate",),
}
"""Module of each public name, as the imports for type checkers above state them too."""
_HOMES = {name: module for module, names in _MODULES.items() for name in names}

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    """Import a public name at its first use."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

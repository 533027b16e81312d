"""Estimated masks of the hand, for pictures of recordings without true silhouettes."""

from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.types import Mask
from depthtrack.viewing.annotated_frame import MaskEstimator


def mask_estimator() -> MaskEstimator:
    """Return an estimator for one recording, to be called on its frames in order.

    It tracks the hand's region from frame to frame.
    """
    segmenter = Segmenter(SkinColourModel.default())

    def estimate(frame: Frame) -> Mask | None:
        observation = segmenter.segment(frame)
        return None if observation is None else observation.whole_mask(frame.depth.shape)

    return estimate

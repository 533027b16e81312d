"""The hand as segmentation finds it, for pictures of recordings that know no true silhouette."""

from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.segmenter import HandLocator
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.types import Mask
from depthtrack.viewing.annotated_frame import MaskEstimator


def mask_estimator() -> MaskEstimator:
    """An estimator for one pass over one recording, frames in their order: it follows the hand from frame to frame."""
    segmenter = HandLocator(SkinColourModel.default())

    def estimate(frame: Frame) -> Mask | None:
        found = segmenter.locate(frame)
        return None if found is None else found.region.paste(found.skin, frame.camera.rect)

    return estimate

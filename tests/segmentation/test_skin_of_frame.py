"""Skin colours of one frame: a glove is found by colour, and by depth alone."""

from dataclasses import replace

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.evaluation.metrics import silhouette_iou
from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.segmentation.skin_of_frame import frame_for_skin, skin_of_frame
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.types import Mask

FRAMES = 6


class Gloved:
    """A recording of a hand in a blue glove: only what the segmenter reads of it."""

    name, has_colour = "gloved", True

    def __init__(self) -> None:
        made = Synthesiser(Synthesis(model="skin", sensor="kinect1", background="room", frames=40, seed=3))
        self.camera = made.sensor.camera
        self.frames: list[Frame] = []
        self.masks: list[Mask] = []
        for place in range(FRAMES):
            frame = made[6 * place]
            assert frame.colour is not None
            colour = frame.colour.copy()
            colour[frame.mask] = (0.5 * colour[frame.mask][:, ::-1]).astype(np.uint8)  # red and blue exchanged
            self.frames.append(Frame(place, place / 5, frame.depth.astype(np.float32), colour, self.camera))
            self.masks.append(frame.mask)

    def __len__(self) -> int:
        return len(self.frames)

    def __getitem__(self, index: int) -> Frame:
        return self.frames[index]

    def mean_iou(self, options: SegmentationOptions) -> float:
        segmenter = Segmenter.for_sequence(self, options)  # type: ignore[arg-type]
        shape, found = self.camera.shape, []
        for frame, mask in zip(self.frames, self.masks, strict=True):
            seen = segmenter.segment(frame)
            found.append(silhouette_iou(np.zeros(shape, np.bool_) if seen is None else seen.whole_mask(shape), mask))
        return float(np.mean(found))


@pytest.fixture(scope="module")
def gloved() -> Gloved:
    return Gloved()


def test_a_glove_is_found_by_its_colours_in_one_frame(gloved: Gloved) -> None:
    assert gloved.mean_iou(SegmentationOptions()) < 0.5
    assert gloved.mean_iou(SegmentationOptions(skin_from=1)) > 0.85


def test_a_glove_is_found_by_depth_alone(gloved: Gloved) -> None:
    assert gloved.mean_iou(SegmentationOptions(use_colour=False)) > 0.75


def test_a_frame_without_hand_or_colour_is_refused(gloved: Gloved) -> None:
    with pytest.raises(InputError, match="frame from 0 to 5 of gloved, found 6"):
        frame_for_skin(gloved, 6)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="found none in frame 0"):
        skin_of_frame(gloved[0], None)
    blind = Gloved.__new__(Gloved)
    blind.frames = [replace(gloved[0], colour=None)]
    with pytest.raises(InputError, match="frame with colour"):
        frame_for_skin(blind, 0)  # type: ignore[arg-type]

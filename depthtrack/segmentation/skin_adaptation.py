"""Skin segmentation by colour that adapts to the light of the scene.

Argyros and Lourakis, "Real-time tracking of multiple skin-colored objects with a possibly moving camera", ECCV 2004.
"""

from collections import deque
from functools import cache

import numpy as np
from numpy.typing import NDArray

from depthtrack.compilation import compiled
from depthtrack.geometry.rectangle import Rect
from depthtrack.segmentation.chroma import BINS, bins_of_colours, colour_index, count_chroma
from depthtrack.segmentation.components import components_with
from depthtrack.segmentation.options import SkinColourOptions
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.types import Array, Image, Labels, Mask

NOT_SKIN, MAYBE_SKIN, SURELY_SKIN = 0, 1, 2
"""Classes of colours: below both thresholds of the hysteresis, between them, and above both."""


class AdaptiveSkin:
    """P(skin | colour): an offline model blended with the statistics of the last frames."""

    def __init__(self, model: SkinColourModel, options: SkinColourOptions | None = None) -> None:
        self._options = options or SkinColourOptions()
        self._offline = model.posterior()
        self.reset()

    def reset(self) -> None:
        """Return to the offline model."""
        self._recent: deque[Array] = deque()
        self._total = np.zeros((2, BINS, BINS))
        self._classes = classes_of_colours(self._offline, self._options)

    def adapt(self, image: Image, region: Rect, skin: Labels, hand: Mask) -> None:
        """Add the pixels of a region on which two masks agree.

        Skin outside the hand (face, arm) and pixels of the hand that are no skin are left out.

        image: (H, W, 3), RGB.
        skin, hand: (h, w) over the region.
        """
        bins = bins_of_colours(self._options.darkest, self._options.brightest)
        self._recent.append(count_chroma(image, region, skin, hand, self._options.adaptation_step, bins))
        self._total += self._recent[-1]
        if len(self._recent) > self._options.adaptation_frames:
            self._total -= self._recent.popleft()
        self._classes = classes_of_colours(self.posterior(), self._options)

    def posterior(self) -> Array:
        """Return P = gamma P_model + (1 - gamma) P_recent (64, 64) by U and V bin.

        Colours without recent pixels keep P_model.
        """
        other, skin = self._total
        count = other + skin
        known = count > 0
        blended, weight = self._offline.copy(), self._options.offline_weight
        blended[known] = weight * blended[known] + (1 - weight) * skin[known] / count[known]
        return blended

    def find(self, image: Image, region: Rect, blocks: Labels, stride: int) -> Labels:
        """Return a mask (h, w), 1 on skin, of a region of an image by hysteresis thresholding.

        image: (H, W, 3), RGB.
        blocks: (rows, columns), 0 for blocks of `stride` x `stride` pixels that are not classified.
        """
        skin = np.zeros((region.height, region.width), dtype=np.uint8)
        rows, columns = np.flatnonzero(blocks.any(axis=1)), np.flatnonzero(blocks.any(axis=0))
        if len(rows):
            i0, i1, j0, j1 = rows[0], rows[-1] + 1, columns[0], columns[-1] + 1
            part = skin[i0 * stride : i1 * stride, j0 * stride : j1 * stride]
            classes = np.empty(part.shape, dtype=np.uint8)
            left, top = int(region.left + j0 * stride), int(region.top + i0 * stride)
            classify(image, left, top, self._classes, np.ascontiguousarray(blocks[i0:i1, j0:j1]), stride, classes)
            part[:] = components_with(classes, SURELY_SKIN)
        return skin

    def find_among(self, image: Image, region: Rect, pixels: Mask) -> Mask:
        """Return the skin (h, w) among pixels (h, w) of a region of an image; others end components.

        image: (H, W, 3), RGB.
        """
        classes = np.empty(pixels.shape, np.uint8)
        classify_pixels(image, region.left, region.top, self._classes, pixels, classes)
        return components_with(classes, SURELY_SKIN).view(np.bool_)


def classes_of_colours(posterior: Array, options: SkinColourOptions) -> Labels:
    """Return NOT_SKIN, MAYBE_SKIN or SURELY_SKIN (32768,) of each quantised colour.

    posterior: (64, 64), P(skin | colour).
    """
    grows, starts = posterior > options.growth_threshold, posterior > options.seed_threshold
    classes = np.append(grows.astype(np.uint8) + starts, np.uint8(NOT_SKIN))
    return classes.take(_class_indices(options.darkest, options.brightest))


@cache
def _class_indices(darkest: float, brightest: float) -> NDArray[np.intp]:
    """Return `bins_of_colours` (32768,) with the index after the last bin in place of -1."""
    bins = bins_of_colours(darkest, brightest).astype(np.intp)
    return np.where(bins < 0, BINS * BINS, bins)


@compiled()
def classify(
    image: Image,
    left: int,
    top: int,
    classes: Labels,
    blocks: Labels,
    stride: int,
    out: Labels,
) -> None:
    """Classify the pixels of a part of an image.

    image: (H, W, 3), RGB.
    left, top: first pixel of the part.
    classes: (32768,) by quantised colour.
    blocks: (rows, columns), 0 for blocks of `stride` x `stride` pixels that are NOT_SKIN.
    out: (h, w) output.
    """
    height, width = out.shape
    for v in range(height):
        i = v // stride
        for j in range(blocks.shape[1]):
            u0, u1 = j * stride, min((j + 1) * stride, width)
            if blocks[i, j] != 0:
                for u in range(u0, u1):
                    out[v, u] = classes[colour_index(image, top + v, left + u)]
            else:
                for u in range(u0, u1):
                    out[v, u] = NOT_SKIN


@compiled(nogil=True)
def classify_pixels(image: Image, left: int, top: int, classes: Labels, pixels: Mask, out: Labels) -> None:
    """Classify some pixels of a part of an image; the others are NOT_SKIN.

    image: (H, W, 3), RGB.
    left, top: first pixel of the part.
    classes: (32768,) by quantised colour.
    pixels: (h, w) pixels to classify.
    out: (h, w) output.
    """
    for v in range(out.shape[0]):
        for u in range(out.shape[1]):
            out[v, u] = classes[colour_index(image, top + v, left + u)] if pixels[v, u] else NOT_SKIN

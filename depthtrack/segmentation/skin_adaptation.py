"""Skin segmentation by colour that adapts to the light of the scene: hysteresis thresholds on P(skin | colour).

Argyros and Lourakis, "Real-time tracking of multiple skin-colored objects with a possibly moving camera", ECCV 2004.
"""

from collections import deque
from functools import cache

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

from depthtrack.geometry.rectangle import Rect
from depthtrack.segmentation.chroma import BINS, bins_of_colours, colour_index, count_chroma
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.types import Array, Image, Labels, Mask

T_MAX, T_MIN = 0.5, 0.15
"""Skin starts where P(skin | colour) exceeds T_MAX and grows through neighbours above T_MIN (ibid., Sec. 2.1)."""

WINDOW, OFFLINE_WEIGHT = 5, 0.8
"""Frames that adapt the model (w), and the weight of the offline model (gamma; ibid., Sec. 2.1)."""

NOT_SKIN, MAYBE_SKIN, SURELY_SKIN = 0, 1, 2


class AdaptiveSkin:
    """P(skin | colour) adapted to the light: the offline model blended with the statistics of the last frames."""

    def __init__(self, model: SkinColourModel) -> None:
        self._offline = model.posterior()
        self.forget()

    def forget(self) -> None:
        """Return to the offline model."""
        self._recent: deque[Array] = deque()
        self._total = np.zeros((2, BINS, BINS))
        self._classes = classes_of_colours(self._offline)

    def learn(self, image: Image, region: Rect, skin: Labels, hand: Mask) -> None:
        """Add the pixels of a region of an RGB image (H, W, 3) on which `skin` and `hand` (h, w) agree.

        Skin outside the hand (face, arm) and pixels of the hand that are no skin are left out.
        """
        self._recent.append(count_chroma(image, region, skin, hand, step=3))
        self._total += self._recent[-1]
        if len(self._recent) > WINDOW:
            self._total -= self._recent.popleft()
        self._classes = classes_of_colours(self.posterior())

    def posterior(self) -> Array:
        """Return P = gamma P_model + (1 - gamma) P_recent (64, 64); P_model for colours not seen recently."""
        other, skin = self._total
        seen = other + skin
        known = seen > 0
        blended = self._offline.copy()
        blended[known] = OFFLINE_WEIGHT * blended[known] + (1 - OFFLINE_WEIGHT) * skin[known] / seen[known]
        return blended

    def find(self, image: Image, region: Rect, blocks: Labels, stride: int) -> Labels:
        """Return a mask (h, w), 1 on skin, of a region of an RGB image (H, W, 3), by hysteresis thresholding.

        Only blocks of `stride` x `stride` pixels where `blocks` (rows, columns) is not 0 are classified.
        """
        skin = np.zeros((region.height, region.width), dtype=np.uint8)
        rows, columns = np.flatnonzero(blocks.any(axis=1)), np.flatnonzero(blocks.any(axis=0))
        if len(rows):
            i0, i1, j0, j1 = rows[0], rows[-1] + 1, columns[0], columns[-1] + 1
            part = skin[i0 * stride : i1 * stride, j0 * stride : j1 * stride]
            classes = np.empty(part.shape, dtype=np.uint8)
            left, top = int(region.left + j0 * stride), int(region.top + i0 * stride)
            classify(image, left, top, self._classes, np.ascontiguousarray(blocks[i0:i1, j0:j1]), stride, classes)
            part[:] = grow_skin(classes)
        return skin


def classes_of_colours(posterior: Array) -> Labels:
    """Return NOT_SKIN, MAYBE_SKIN or SURELY_SKIN (32768,) of each quantised colour for P(skin | colour) (64, 64)."""
    classes = np.append((posterior > T_MIN).astype(np.uint8) + (posterior > T_MAX), np.uint8(NOT_SKIN))
    return classes.take(_places_of_colours())


@cache
def _places_of_colours() -> NDArray[np.intp]:
    """Return `bins_of_colours` (32768,) with the index after the last bin if the luminance is out of range."""
    bins = bins_of_colours().astype(np.intp)
    return np.where(bins < 0, BINS * BINS, bins)


@numba.njit(cache=True)
def classify(
    image: Image,
    left: int,
    top: int,
    classes: Labels,
    blocks: Labels,
    stride: int,
    out: Labels,
) -> None:
    """Write to `out` (h, w) the classes, from the table `classes` (32768,), of pixels from (left, top) of an RGB image.

    `out` is NOT_SKIN where `blocks` (rows, columns) of `stride` x `stride` pixels is 0.
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


def grow_skin(classes: Labels) -> Labels:
    """Return 1 (h, w) on the 8-connected components of MAYBE_SKIN and SURELY_SKIN that hold a SURELY_SKIN pixel."""
    count, components = cv2.connectedComponents((classes != NOT_SKIN).view(np.uint8), connectivity=8)
    is_skin = np.zeros(count, dtype=np.uint8)
    is_skin[components[classes == SURELY_SKIN]] = 1
    return is_skin[components]

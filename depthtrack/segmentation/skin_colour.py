"""Skin colour after Argyros and Lourakis, "Real-time tracking of multiple skin-colored objects with a possibly moving
camera", ECCV 2004: Bayes' rule on chroma, hysteresis thresholds, and adaptation to the light of the scene.

Colours are looked up by chroma alone (U and V of YUV), because luminance changes most with the light.
"""

import json
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Self

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import InputError
from depthtrack.files import read_json, write_atomic
from depthtrack.geometry.rectangle import Rect
from depthtrack.segmentation.skin_statistics import OTHER, SKIN, Mixture
from depthtrack.types import Array, Image, Index, Labels, Mask

BINS, LEVELS = 64, 32
"""Bins along U and along V, and steps of R, G and B by which a colour's bin is looked up."""

T_MAX, T_MIN = 0.5, 0.15
"""Skin starts where P(skin | colour) exceeds T_MAX and grows through neighbours above T_MIN (ibid., Sec. 2.1)."""

WINDOW, OFFLINE_WEIGHT = 5, 0.8
"""Frames that adapt the model (w), and the weight of what was learnt before them (gamma; ibid., Sec. 2.1)."""

DEFAULT_PRIOR = 0.4
"""P(skin) of the built-in model. Web pictures hold about 9 % skin, but here colour is asked about things at the hand's
distance, of which hand and forearm make up a large share."""

DARKEST, BRIGHTEST = 20, 250
"""Outside these luminances chroma means nothing: the sensor's noise, or its saturation, decides it."""

NOT_SKIN, MAYBE_SKIN, SURELY_SKIN = 0, 1, 2


_LARGEST_FILE = 4 << 20
# Rows Y, U and V of the full-range YUV of JPEG (ITU-R BT.601); U and V are 0 for greys.
_LUMINANCE = np.array([0.299, 0.587, 0.114])
_CHROMA = np.array([[-0.168736, -0.331264, 0.5], [0.5, -0.418688, -0.081312]])


@dataclass(frozen=True)
class SkinColourModel:
    """What is known of skin before a recording is seen.

    `skin` and `other` (64, 64) are P(colour | skin) and P(colour | not skin) by U and V bin; they are scaled to sum
    to 1. `prior` is P(skin). Raises InputError when they can be no probabilities.
    """

    skin: Array
    other: Array
    prior: float

    def __post_init__(self) -> None:
        for name in ("skin", "other"):
            table = np.array(getattr(self, name), dtype=np.float64)
            if table.shape != (BINS, BINS) or not np.all(np.isfinite(table)) or table.min() < 0 or table.sum() <= 0:
                raise InputError(f"a skin model's '{name}' must be {BINS}x{BINS} numbers of at least 0, not all 0")
            object.__setattr__(self, name, table / table.sum())
        if not 0 < self.prior < 1:
            raise InputError(f"a skin model's 'prior' must be a probability between 0 and 1, found {self.prior!r}")

    @classmethod
    def default(cls) -> "SkinColourModel":
        """The model built from the statistics of Jones and Rehg."""
        return _default_model()

    @classmethod
    def train(cls, labelled: Iterable[tuple[Labels, Mask]]) -> Self:
        """Learn from pairs of an RGB image (h, w, 3) and a mask (h, w) that is true on skin.

        The prior is the share of skin among all pixels. Raises InputError without both skin and other pixels.
        """
        counts = np.zeros((2, BINS, BINS))
        for image, mask in labelled:
            if image.shape != (*mask.shape, 3):
                raise InputError(f"an image of shape {image.shape} cannot have a mask of shape {mask.shape}")
            whole = Rect.of_image(image.shape)
            counts += _count(np.ascontiguousarray(image), whole, mask.astype(np.uint8), mask, step=1)
        other, skin = counts
        if skin.sum() == 0 or other.sum() == 0:
            raise InputError(
                f"training needs pixels of skin and of other things, found {skin.sum():.0f} and {other.sum():.0f}:"
                " check that the masks are white on skin and black elsewhere"
            )
        return cls(skin, other, float(skin.sum() / counts.sum()))

    def posterior(self) -> Array:
        """P(skin | colour) (64, 64) by U and V bin: Bayes' rule; 0 for colours that neither table knows."""
        joint = self.skin * self.prior
        evidence = joint + self.other * (1 - self.prior)
        # Rarer colours than this are the tails of a fitted curve, not knowledge.
        return np.where(evidence > 1e-9, joint / np.maximum(evidence, 1e-9), 0.0)

    def save(self, path: Path) -> None:
        """Write the model as JSON.

        Raises: InputError if the file cannot be written.
        """
        text = json.dumps({"prior": self.prior, "skin": self.skin.tolist(), "other": self.other.tolist()})
        write_atomic(path, text + "\n")

    @classmethod
    def load(cls, path: Path) -> Self:
        """Return the model that `save` wrote.

        Raises: InputError if the file is missing, malformed, or its tables are no probabilities.
        """
        return read_json(path, "the skin model", cls._from_fields, _LARGEST_FILE, made_by="depthtrack train-skin")

    @classmethod
    def _from_fields(cls, fields: Any) -> Self:
        return cls(fields["skin"], fields["other"], float(fields["prior"]))


@cache
def _default_model() -> SkinColourModel:
    return SkinColourModel(chroma_distribution(SKIN), chroma_distribution(OTHER), DEFAULT_PRIOR)


def chroma_distribution(mixture: Mixture) -> Array:
    """P(colour) (64, 64) by U and V bin of a mixture of Gaussians in RGB.

    Chroma is linear in RGB, so that each Gaussian's chroma is again a Gaussian, summed up over luminance.
    """
    width = 256 / BINS
    centres = (np.arange(BINS) + 0.5) * width - 128
    u, v = np.meshgrid(centres, centres, indexing="ij")
    total = np.zeros((BINS, BINS))
    for mean, variance, weight in zip(*mixture, strict=True):
        # A bin's own width blurs what falls into it.
        covariance = _CHROMA @ np.diag(variance) @ _CHROMA.T + np.eye(2) * width**2 / 12
        offset = np.stack([u, v], axis=-1) - _CHROMA @ mean
        distance = np.einsum("...i,ij,...j", offset, np.linalg.inv(covariance), offset)
        total += weight * np.exp(-distance / 2) / np.sqrt(np.linalg.det(covariance))
    return total / total.sum()


@cache
def _bin_of_colour() -> NDArray[np.int16]:
    """Flat U and V bin (32768,) of every colour, in steps of 8 levels of R, G and B; -1 where luminance is useless."""
    level = np.arange(LEVELS) * 8 + 3.5
    rgb = np.stack(np.meshgrid(level, level, level, indexing="ij"), axis=-1).reshape(-1, 3)
    # Greys lie on a bin's edge: rounding must not scatter them.
    u, v = np.clip((rgb @ _CHROMA.T + 128) * BINS / 256 + 1e-9, 0, BINS - 1).astype(np.int16).T
    luminance = rgb @ _LUMINANCE
    return np.where((luminance >= DARKEST) & (luminance <= BRIGHTEST), u * BINS + v, np.int16(-1)).astype(np.int16)


class AdaptiveSkin:
    """P(skin | colour) that follows the light: the model, blended with what the last frames showed."""

    def __init__(self, model: SkinColourModel) -> None:
        self._offline = model.posterior()
        self.forget()

    def forget(self) -> None:
        """Back to the model alone."""
        self._recent: deque[Array] = deque()
        self._total = np.zeros((2, BINS, BINS))
        self._classes = class_of_colour(self._offline)

    def learn(self, image: Image, region: Rect, skin: Labels, hand: Mask) -> None:
        """Take in a region of an RGB image: its `skin` (h, w; not 0) that is `hand` (h, w), and what is neither.

        Skin elsewhere, as a face's or the arm's, and what the hand has that is no skin, are left out.
        """
        self._recent.append(_count(image, region, skin, hand, step=3))
        self._total += self._recent[-1]
        if len(self._recent) > WINDOW:
            self._total -= self._recent.popleft()
        self._classes = class_of_colour(self.posterior())

    def posterior(self) -> Array:
        """P = gamma P_model + (1 - gamma) P_recent (64, 64); colours not seen recently keep the model's."""
        other, skin = self._total
        seen = other + skin
        known = seen > 0
        blended = self._offline.copy()
        blended[known] = OFFLINE_WEIGHT * blended[known] + (1 - OFFLINE_WEIGHT) * skin[known] / seen[known]
        return blended

    def find(self, image: Image, region: Rect, blocks: Labels, stride: int) -> Labels:
        """1 on skin, over a region of an RGB image (h, w, 3), found with hysteresis.

        Only blocks of `stride` x `stride` pixels where `blocks` (rows, columns) is not 0 are looked at.
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


def class_of_colour(posterior: Array) -> Labels:
    """NOT_SKIN, MAYBE_SKIN or SURELY_SKIN (32768,) of every colour, for P(skin | colour) (64, 64)."""
    classes = np.append((posterior > T_MIN).astype(np.uint8) + (posterior > T_MAX), np.uint8(NOT_SKIN))
    return classes.take(_place_of_colour())


@cache
def _place_of_colour() -> NDArray[np.intp]:
    """The same as `_bin_of_colour`, with the place after the last bin for useless luminance."""
    bins = _bin_of_colour().astype(np.intp)
    return np.where(bins < 0, BINS * BINS, bins)


def _count(image: Image, region: Rect, skin: Labels, hand: Mask, step: int) -> Array:
    """Pixels (2, 64, 64) of neither skin nor hand, and of both, by U and V bin; every `step`-th both ways."""
    counts = np.zeros((2, BINS * BINS))
    count_colours(image, tuple(region), skin, hand, step, _bin_of_colour(), counts)
    return counts.reshape(2, BINS, BINS)


@numba.njit(cache=True, inline="always")
def _colour_index(image: Image, y: int, x: int) -> int:
    return (int(image[y, x, 0]) >> 3) << 10 | (int(image[y, x, 1]) >> 3) << 5 | int(image[y, x, 2]) >> 3


@numba.njit(cache=True)
def count_colours(
    image: Image,
    region: tuple[int, int, int, int],
    skin: Labels,
    hand: Mask,
    step: int,
    bin_of_colour: NDArray[np.int16],
    counts: Array,
) -> None:
    """Add to `counts` (2, 4096) the pixels of a region where `skin` and `hand` (h, w) agree, by that and by bin."""
    left, top, _, _ = region
    for v in range(0, skin.shape[0], step):
        for u in range(0, skin.shape[1], step):
            if (skin[v, u] != 0) == hand[v, u]:
                chroma = bin_of_colour[_colour_index(image, top + v, left + u)]
                if chroma >= 0:
                    counts[int(hand[v, u]), chroma] += 1


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
    """Class of the pixels of an RGB image (h, w, 3) from (left, top) on, looked up in `classes` (32768,), into `out`;
    NOT_SKIN where `blocks` (rows, columns) of `stride` x `stride` pixels is 0."""
    height, width = out.shape
    for v in range(height):
        i = v // stride
        for j in range(blocks.shape[1]):
            u0, u1 = j * stride, min((j + 1) * stride, width)
            if blocks[i, j] != 0:
                for u in range(u0, u1):
                    out[v, u] = classes[_colour_index(image, top + v, left + u)]
            else:
                for u in range(u0, u1):
                    out[v, u] = NOT_SKIN


def grow_skin(classes: Labels) -> Labels:
    """Hysteresis: 1 where `classes` (h, w) is SURELY_SKIN, or MAYBE_SKIN and joined to that, 8-connected."""
    grown = (classes == SURELY_SKIN).view(np.uint8)
    beside = cv2.dilate(grown, np.ones((3, 3), np.uint8)).view(np.bool_)
    maybe = classes == MAYBE_SKIN
    grow_into(classes, np.flatnonzero(maybe & beside), int(np.count_nonzero(maybe)), grown)
    return grown


@numba.njit(cache=True)
def grow_into(classes: Labels, seeds: Index, most: int, grown: Labels) -> None:
    """Add to `grown` (h, w), in place, the `seeds` (flat indices of MAYBE_SKIN) and all MAYBE_SKIN joined to them, of
    which there are at `most` so many."""
    rows, columns = classes.shape
    label, skin = classes.ravel(), grown.ravel()
    stack = np.empty(most, dtype=np.int64)
    for seed in seeds:
        if skin[seed] != 0:
            continue
        skin[seed] = 1
        stack[0] = seed
        size = 1
        while size > 0:
            size -= 1
            v, u = stack[size] // columns, stack[size] % columns
            for k in range(max(v - 1, 0), min(v + 2, rows)):
                for there in range(k * columns + max(u - 1, 0), k * columns + min(u + 2, columns)):
                    if label[there] == MAYBE_SKIN and skin[there] == 0:
                        skin[there] = 1
                        stack[size] = there
                        size += 1

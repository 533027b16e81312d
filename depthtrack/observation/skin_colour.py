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
from typing import Self

import numba
import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import InputError
from depthtrack.observation.skin_statistics import OTHER, SKIN, Mixture
from depthtrack.observation.window import Window

BINS = 64
"""Bins along U and along V; each holds 4 of the 256 levels."""

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

Array = NDArray[np.float64]

_LARGEST_FILE = 4 << 20
# Rows U and V of the full-range YUV of JPEG (ITU-R BT.601); both are 0 for greys.
_CHROMA = np.array([[-0.168736, -0.331264, 0.5], [0.5, -0.418688, -0.081312]])


@dataclass(frozen=True)
class SkinModel:
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
    def default(cls) -> "SkinModel":
        """The model built from the statistics of Jones and Rehg."""
        return _default_model()

    @classmethod
    def train(cls, labelled: Iterable[tuple[NDArray[np.uint8], NDArray[np.bool_]]]) -> Self:
        """Learn from pairs of an RGB image (h, w, 3) and a mask (h, w) that is true on skin.

        The prior is the share of skin among all pixels. Raises InputError without both skin and other pixels.
        """
        counts = np.zeros((2, BINS, BINS))
        for image, mask in labelled:
            if image.shape != (*mask.shape, 3):
                raise InputError(f"an image of shape {image.shape} cannot have a mask of shape {mask.shape}")
            counts += count_colours(image, np.where(mask, SURELY_SKIN, NOT_SKIN).astype(np.uint8))
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
        """Write the model as JSON, complete or not at all. Raises InputError."""
        text = json.dumps({"prior": self.prior, "skin": self.skin.tolist(), "other": self.other.tolist()})
        partial = path.with_name(path.name + ".part")
        try:
            partial.write_text(text + "\n", encoding="utf-8")
            partial.replace(path)
        except OSError as error:
            raise InputError(f"cannot write the skin model {path}: {error.strerror}") from error

    @classmethod
    def load(cls, path: Path) -> Self:
        """Read what `save` wrote. Raises InputError."""
        try:
            if path.stat().st_size > _LARGEST_FILE:
                raise InputError(f"{path} is too large to be a skin model: write one with `depthtrack train-skin`")
            fields = json.loads(path.read_text(encoding="utf-8"))
            return cls(fields["skin"], fields["other"], float(fields["prior"]))
        except OSError as error:
            raise InputError(f"cannot read the skin model {path}: {error.strerror}") from error
        except (ValueError, TypeError, KeyError, RecursionError) as error:
            raise InputError(f"{path} is no skin model: write one with `depthtrack train-skin` ({error!r})") from error


@cache
def _default_model() -> SkinModel:
    return SkinModel(chroma_distribution(SKIN), chroma_distribution(OTHER), DEFAULT_PRIOR)


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


class AdaptiveSkin:
    """P(skin | colour) that follows the light: the model, blended with what the last frames showed."""

    def __init__(self, model: SkinModel) -> None:
        self._offline = model.posterior()
        self.forget()

    def forget(self) -> None:
        """Back to the model alone."""
        self._recent: deque[Array] = deque(maxlen=WINDOW)
        self._classes = _classes(self._offline)

    def learn(self, image: NDArray[np.uint8], labels: NDArray[np.uint8]) -> None:
        """Take in a frame (h, w, 3) labelled (h, w) SURELY_SKIN, NOT_SKIN, or MAYBE_SKIN where it is left open."""
        self._recent.append(count_colours(image, labels))
        self._classes = _classes(self.posterior())

    def posterior(self) -> Array:
        """P = gamma P_model + (1 - gamma) P_recent (64, 64); colours not seen recently keep the model's."""
        if not self._recent:
            return self._offline
        other, skin = sum(self._recent, np.zeros((2, BINS, BINS)))
        seen = other + skin
        recent = np.where(seen > 0, skin / np.maximum(seen, 1), self._offline)
        return OFFLINE_WEIGHT * self._offline + (1 - OFFLINE_WEIGHT) * recent

    def find(
        self, image: NDArray[np.uint8], window: Window, blocks: NDArray[np.uint8], stride: int
    ) -> NDArray[np.uint8]:
        """1 on skin, over a window of an RGB image (h, w, 3), found with hysteresis.

        Only blocks of `stride` x `stride` pixels where `blocks` (rows, columns) is not 0 are looked at.
        """
        classes = np.empty((window.height, window.width), dtype=np.uint8)
        classify(image, tuple(window), self._classes, blocks, stride, classes)
        skin = np.empty_like(classes)
        grow_skin(classes, skin)
        return skin


def _classes(posterior: Array) -> NDArray[np.uint8]:
    """NOT_SKIN, MAYBE_SKIN or SURELY_SKIN (64, 64) by U and V bin."""
    return (posterior > T_MIN).astype(np.uint8) + (posterior > T_MAX).astype(np.uint8)


def count_colours(image: NDArray[np.uint8], labels: NDArray[np.uint8]) -> Array:
    """Pixels (2, 64, 64) that are not skin and that are, by U and V bin, of an RGB image (h, w, 3)."""
    counts = np.zeros((2, BINS, BINS))
    _count(image, labels, counts)
    return counts


@numba.njit(cache=True, inline="always")
def chroma_bins(r: int, g: int, b: int) -> tuple[int, int, bool]:
    """U and V bin of a colour, and whether its luminance lets chroma mean something; 8-bit fixed point."""
    y = (77 * r + 150 * g + 29 * b) >> 8
    u = (-43 * r - 85 * g + 128 * b + 32768) >> 10
    v = (128 * r - 107 * g - 21 * b + 32768) >> 10
    return min(u, BINS - 1), min(v, BINS - 1), DARKEST <= y <= BRIGHTEST


@numba.njit(cache=True)
def _count(image: NDArray[np.uint8], labels: NDArray[np.uint8], counts: Array) -> None:
    for i in range(labels.shape[0]):
        for j in range(labels.shape[1]):
            label = labels[i, j]
            if label != MAYBE_SKIN:
                u, v, usable = chroma_bins(int(image[i, j, 0]), int(image[i, j, 1]), int(image[i, j, 2]))
                if usable:
                    counts[label >> 1, u, v] += 1


@numba.njit(cache=True)
def classify(
    image: NDArray[np.uint8],
    window: tuple[int, int, int, int],
    classes: NDArray[np.uint8],
    blocks: NDArray[np.uint8],
    stride: int,
    out: NDArray[np.uint8],
) -> None:
    """Class of the pixels in a window of an RGB image (h, w, 3), looked up in `classes` (64, 64), into `out`; NOT_SKIN
    where `blocks` (rows, columns) of `stride` x `stride` pixels is 0."""
    left, top, _, _ = window
    height, width = out.shape
    for v in range(height):
        i = v // stride
        for j in range(blocks.shape[1]):
            for u in range(j * stride, min((j + 1) * stride, width)):
                label = NOT_SKIN
                if blocks[i, j] != 0:
                    y, x = top + v, left + u
                    du, dv, usable = chroma_bins(int(image[y, x, 0]), int(image[y, x, 1]), int(image[y, x, 2]))
                    if usable:
                        label = classes[du, dv]
                out[v, u] = label


@numba.njit(cache=True)
def grow_skin(classes: NDArray[np.uint8], out: NDArray[np.uint8]) -> None:
    """Hysteresis: `out` (h, w) is 1 where `classes` is SURELY_SKIN, or MAYBE_SKIN and joined to that, 8-connected."""
    rows, columns = classes.shape
    seeds, grown = classes.ravel(), out.ravel()
    around = (-columns - 1, -columns, -columns + 1, -1, 1, columns - 1, columns, columns + 1)
    stack = np.empty(seeds.size, dtype=np.int32)
    grown[:] = 0
    for start in range(seeds.size):
        if seeds[start] != SURELY_SKIN or grown[start] != 0:
            continue
        grown[start] = 1
        stack[0] = start
        size = 1
        while size > 0:
            size -= 1
            here = stack[size]
            row, column = here // columns, here % columns
            inside = 0 < row < rows - 1 and 0 < column < columns - 1
            for offset in around:
                there = here + offset
                if not inside and not (0 <= there < seeds.size and abs(there % columns - column) <= 1):
                    continue
                if grown[there] == 0 and seeds[there] != NOT_SKIN:
                    grown[there] = 1
                    stack[size] = there
                    size += 1

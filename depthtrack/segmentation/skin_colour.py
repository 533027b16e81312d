"""Colour statistics of skin and of other surfaces: Bayes' rule on chroma.

Argyros and Lourakis, "Real-time tracking of multiple skin-colored objects with a possibly moving camera", ECCV 2004.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Self

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import read_json, write_atomic
from depthtrack.geometry.rectangle import Rect
from depthtrack.segmentation.chroma import BINS, CHROMA, bins_of_colours, count_chroma
from depthtrack.segmentation.options import SkinColourOptions
from depthtrack.segmentation.skin_statistics import OTHER, SKIN, Mixture
from depthtrack.strict_data import exact_json_text
from depthtrack.types import Array, Labels, Mask

MAX_BYTES = 4 << 20
"""Largest file of a model."""


@dataclass(frozen=True)
class SkinColourModel:
    """Offline colour statistics of skin.

    skin, other: (64, 64), P(colour | skin) and P(colour | not skin) by U and V bin, scaled to sum to 1.
    prior: P(skin).

    Raises:
        InputError: a table or the prior is no probability.
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
    def default(cls, prior: float = SkinColourOptions().prior) -> "SkinColourModel":
        """Return the model of the statistics of Jones and Rehg with a prior P(skin)."""
        return _default_model(prior)

    @classmethod
    def train(cls, labelled: Iterable[tuple[Labels, Mask]]) -> Self:
        """Return the model of labelled images; its prior is the share of skin among all pixels.

        labelled: pairs of an RGB image (h, w, 3) and a mask (h, w) that is true on skin.

        Raises:
            InputError: the shapes differ, or there are no pixels of skin or no others.
        """
        options = SkinColourOptions()
        bins = bins_of_colours(options.darkest, options.brightest)
        counts = np.zeros((2, BINS, BINS))
        for image, mask in labelled:
            if image.shape != (*mask.shape, 3):
                raise InputError(f"an image of shape {image.shape} cannot have a mask of shape {mask.shape}")
            whole = Rect.of_image(image.shape)
            counts += count_chroma(np.ascontiguousarray(image), whole, mask.astype(np.uint8), mask, 1, bins)
        other, skin = counts
        if skin.sum() == 0 or other.sum() == 0:
            raise InputError(
                f"training needs pixels of skin and of other surfaces, found {skin.sum():.0f} and {other.sum():.0f}:"
                " check that the masks are white on skin and black elsewhere"
            )
        return cls(skin, other, float(skin.sum() / counts.sum()))

    def posterior(self) -> Array:
        """Return P(skin | colour) (64, 64) by U and V bin; 0 for colours in neither table."""
        joint = self.skin * self.prior
        evidence = joint + self.other * (1 - self.prior)
        # Rarer colours than this are the tails of a fitted curve.
        return np.where(evidence > 1e-9, joint / np.maximum(evidence, 1e-9), 0.0)

    def save(self, path: Path) -> None:
        """Write the model as JSON.

        Raises:
            InputError: the file cannot be written.
        """
        text = exact_json_text({"prior": self.prior, "skin": self.skin.tolist(), "other": self.other.tolist()})
        write_atomic(path, text + "\n")

    @classmethod
    def load(cls, path: Path) -> Self:
        """Return the model that `save` wrote.

        Raises:
            InputError: the file is missing or malformed, or its tables are no probabilities.
        """
        return read_json(path, "the skin model", cls._from_fields, MAX_BYTES, made_by="depthtrack train-skin")

    @classmethod
    def _from_fields(cls, fields: Any) -> Self:
        return cls(fields["skin"], fields["other"], float(fields["prior"]))


@cache
def _default_model(prior: float) -> SkinColourModel:
    return SkinColourModel(chroma_distribution(SKIN), chroma_distribution(OTHER), prior)


def chroma_distribution(mixture: Mixture) -> Array:
    """Return P(colour) (64, 64) by U and V bin of a mixture of Gaussians in RGB.

    Chroma is linear in RGB, so the chroma of each Gaussian is again a Gaussian, marginalised over luminance.
    """
    width = 256 / BINS
    centres = (np.arange(BINS) + 0.5) * width - 128
    u, v = np.meshgrid(centres, centres, indexing="ij")
    total = np.zeros((BINS, BINS))
    for mean, variance, weight in zip(*mixture, strict=True):
        # The width of a bin adds its own variance.
        covariance = CHROMA @ np.diag(variance) @ CHROMA.T + np.eye(2) * width**2 / 12
        offset = np.stack([u, v], axis=-1) - CHROMA @ mean
        distance = np.einsum("...i,ij,...j", offset, np.linalg.inv(covariance), offset)
        total += weight * np.exp(-distance / 2) / np.sqrt(np.linalg.det(covariance))
    return total / total.sum()

"""Layouts of the average hand for a small set of postures."""

import numpy as np
import pytest

from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.shape import HandShape
from depthtrack.markers.layout.candidates import Candidates
from depthtrack.markers.layout.options import QualityOptions
from depthtrack.markers.layout.quality import LayoutQuality
from depthtrack.types import Array


@pytest.fixture(scope="session")
def candidates() -> Candidates:
    return Candidates.on_skin(HandShape())


@pytest.fixture(scope="session")
def postures() -> Array:
    """Postures (40, 20) that differ in three directions, and a little in all others."""
    rng = np.random.default_rng(3)
    directions = rng.normal(size=(3, 20)) * np.array([[1.0], [0.6], [0.4]])
    angles = 0.3 * (LOWER + UPPER) + 0.2 * rng.normal(size=(40, 3)) @ directions + 0.005 * rng.normal(size=(40, 20))
    return np.clip(angles, LOWER, UPPER)


@pytest.fixture(scope="session")
def quality(candidates: Candidates, postures: Array) -> LayoutQuality:
    """The objective of the paper."""
    return LayoutQuality.of(candidates, postures, QualityOptions(objective="condition", key_frames=4, components=3))


@pytest.fixture(scope="session")
def expected(candidates: Candidates, postures: Array) -> LayoutQuality:
    """The expected error."""
    return LayoutQuality.of(candidates, postures, QualityOptions(key_frames=3))

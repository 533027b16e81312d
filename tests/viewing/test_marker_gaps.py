"""Pages of filled gaps: every filled gap once, equal bytes."""

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from depthtrack.markers.filled_capture import FilledCapture, Filling
from depthtrack.viewing import marker_gaps
from depthtrack.viewing.marker_gaps import GAPS_PER_PAGE, gap_pages
from tests.support.markers import filled_hands, labelled_hands


@pytest.fixture(scope="module")
def filled() -> FilledCapture:
    return filled_hands(labelled_hands(frames=40))


def test_every_filled_gap_is_drawn_once(filled: FilledCapture, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = []
    monkeypatch.setattr(marker_gaps, "_draw_gap", lambda axes, capture, gap: drawn.append(gap))
    pages = list(gap_pages(filled, "capture"))
    wanted = [gap for gap in filled.gaps() if np.any(filled.how[gap.model][gap.start : gap.stop, gap.marker] > 1)]
    assert 0 < len(wanted) < len(filled.gaps())
    assert sorted(drawn) == sorted(wanted)
    assert [gap.length for gap in drawn] == sorted((gap.length for gap in wanted), reverse=True)
    assert len(pages) == -(-len(wanted) // GAPS_PER_PAGE)


def test_a_capture_without_filled_gaps_has_no_page(filled: FilledCapture) -> None:
    nothing = tuple(np.where(how == Filling.MEASURED, how, Filling.GAP) for how in filled.how)
    assert list(gap_pages(replace(filled, how=nothing), "capture")) == []


def test_a_page_shows_the_filled_positions(filled: FilledCapture) -> None:
    def first_page(capture: FilledCapture) -> np.ndarray:
        return np.asarray(Image.open(BytesIO(next(gap_pages(capture, "capture")))).convert("RGB")).astype(int)

    plain = first_page(filled)
    assert np.array_equal(plain, first_page(filled))
    bent = tuple(
        np.where((how > 1)[..., None], at + 0.02, at) for how, at in zip(filled.how, filled.positions, strict=True)
    )
    assert np.abs(first_page(replace(filled, positions=bent)) - plain).max() > 100

"""Rigid bodies from chosen markers."""

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.geometry.rotations import rotation_matrix
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.models.rigid_body import body_from_markers
from depthtrack.types import Array

PATTERN = np.array([[0, 0, 0], [0.07, 0, 0], [0, 0.05, 0], [0.02, 0.01, 0.04], [0.05, 0.06, 0.03]])
LABELS = ("a", "b", "c", "d", "e", "far")


def capture(noise: float = 0.0, frames: int = 60) -> MarkerCapture:
    rng = np.random.default_rng(0)
    R = rotation_matrix(rng.normal(size=(frames, 4)))
    places = np.einsum("tij,mj->tmi", R, PATTERN) + rng.normal(0, 0.3, (frames, 1, 3))
    places = np.concatenate([places, np.ones((frames, 1, 3))], axis=1)
    return MarkerCapture(100.0, LABELS, places + rng.normal(0, noise, places.shape))


def distances(places: Array) -> Array:
    return np.asarray(np.linalg.norm(places[:, None] - places, axis=-1))


def test_median_of_noisy_frames_is_closer_than_one_frame() -> None:
    moving = capture(noise=0.001)
    body = body_from_markers(moving, ("a", "b", "c", "d"), "box")
    single = body_from_markers(moving, ("a", "b", "c", "d"), "box", frame=4)
    error, single_error = (np.abs(distances(b.offsets) - distances(PATTERN[:4])).max() for b in (body, single))
    assert error < 0.0006
    assert error < single_error
    assert body.is_rigid
    assert body.name == "box"
    np.testing.assert_array_equal(body.offsets[0], 0)
    np.testing.assert_allclose(body.spread, 0.001, rtol=0.6)


def test_first_marker_is_the_origin() -> None:
    body = body_from_markers(capture(), ("c", "a", "b"), "box")
    assert body.labels == ("c", "a", "b")
    np.testing.assert_allclose(distances(body.offsets), distances(PATTERN[[2, 0, 1]]), atol=1e-9)


def test_markers_that_are_never_all_visible_are_joined() -> None:
    moving = capture()
    moving.positions[::2, 3] = np.nan
    moving.positions[1::2, 0] = np.nan
    body = body_from_markers(moving, ("a", "b", "c", "d", "e"), "box")
    np.testing.assert_allclose(distances(body.offsets), distances(PATTERN), atol=1e-9)


def test_marker_that_is_never_seen_with_the_others_is_named() -> None:
    moving = capture()
    moving.positions[:, 3] = np.nan
    with pytest.raises(InputError, match="'d' is never seen together"):
        body_from_markers(moving, ("a", "b", "c", "d"), "box")


@pytest.mark.parametrize(
    ("labels", "frame", "message"),
    [
        (("a", "b", "x"), None, "no marker 'x'"),
        (("a", "b"), None, "at least 3 markers, found 2"),
        (("a", "b", "c"), 60, "from 1 to 60, found 61"),
    ],
)
def test_wrong_choices_are_refused(labels: tuple[str, ...], frame: int | None, message: str) -> None:
    with pytest.raises(InputError, match=message):
        body_from_markers(capture(), labels, "box", frame)


def test_body_that_is_never_visible_is_refused() -> None:
    moving = capture()
    moving.positions[:, 1:5] = np.nan
    with pytest.raises(InputError, match="no frame shows three"):
        body_from_markers(moving, ("a", "b", "c", "d"), "box")

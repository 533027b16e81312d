"""Any labels of nodes and any frame give an observation or none, and no error."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from depthtrack.geometry.camera import Camera
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.hand.shape import HandShape
from depthtrack.recording.sequence import Frame
from depthtrack.segmentation import hand_locator
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.pixel_labels import ARM, ATTACHED, BACKGROUND, HAND
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.synthesis.generate import Synthesiser
from depthtrack.tracking.guided_segmentation import roi_prior

CAMERA = Camera(80, 60, 75.0, 75.0, 39.5, 29.5, 0.001)
SKIN, BLUE = (200, 150, 120), (30, 60, 160)
MODEL = HandModel(HandShape())
LABELS = np.array([BACKGROUND, HAND, ARM, ATTACHED], dtype=np.uint8)
seeds = st.integers(0, 2**32 - 1)


def check(observation: Observation | None, camera: Camera) -> None:
    """Check that an observation has readings, lies within the image, and is finite."""
    if observation is None:
        return
    assert observation.depth.shape == observation.silhouette.shape == observation.region.shape
    assert observation.region.clipped(camera.rect) == observation.region
    assert np.isfinite(observation.depth).all()
    assert (observation.depth > 0).any()
    assert np.isfinite(observation.centre).all()
    assert np.isfinite(observation.points).all()


def label_grid(kind: str, shape: tuple[int, int], rng: np.random.Generator) -> np.ndarray:
    """Return labels of nodes (rows, columns)."""
    labels = np.zeros(shape, dtype=np.uint8)
    match kind:
        case "one node":
            labels[tuple(rng.integers(shape))] = HAND
        case "border":
            labels[[0, -1]], labels[:, [0, -1]] = HAND, HAND
        case "all":
            labels[:] = HAND
        case "no hand":
            labels[:] = rng.choice(LABELS[[0, 2, 3]], shape)
        case "any":
            labels[:] = rng.choice(LABELS, shape)
    return labels


@pytest.mark.parametrize("kind", ["empty", "one node", "border", "all", "no hand", "any"])
def test_any_labels_of_nodes(everyday: Synthesiser, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    made, rng = everyday[0], np.random.default_rng(len(kind))
    colour = np.full((*made.depth.shape, 3), SKIN, dtype=np.uint8)
    for with_colour in (False, True):
        frame = Frame(0, 0.0, made.depth.astype(np.float32), colour if with_colour else None, everyday.sensor.camera)
        for _ in range(3):

            def labelled(surface, *_):  # type: ignore[no-untyped-def]
                # Nodes without a reading are never hand.
                labels = label_grid(kind, surface.grid.depth.shape, rng)
                return np.where(surface.candidates.depth > 0, labels, 0).astype(np.uint8)

            monkeypatch.setattr(hand_locator, "label_hand", labelled)
            found = Segmenter(SkinColourModel.default() if with_colour else None).segment(frame)
            check(found, everyday.sensor.camera)
            assert found is None or kind not in ("empty", "no hand")


def depth_image(kind: str, rng: np.random.Generator) -> np.ndarray:
    """Return depth (h, w), metres."""
    depth = np.zeros(CAMERA.shape, dtype=np.float32)
    near = float(rng.uniform(0.05, 1.2))
    v, u = np.indices(CAMERA.shape)
    match kind:
        case "plane":
            depth[:] = near
        case "tilted":
            depth[:] = np.clip(near + 0.01 * (u - 40) * rng.uniform(-1, 1), 0, 9)
        case "noise":
            depth[:] = rng.uniform(0, 2, CAMERA.shape)
        case "checks":
            depth[(u // 3 + v // 3) % 2 == 0] = near
        case "pixels":
            depth[tuple(rng.integers(CAMERA.shape, size=(5, 2)).T)] = near
        case "discs":
            for _ in range(4):
                radius, x, y = rng.uniform(2, 25), rng.uniform(-10, 90), rng.uniform(-10, 70)
                depth[(u - x) ** 2 + (v - y) ** 2 < radius**2] = rng.uniform(0.2, 1.2)
        case "border":
            depth[:3], depth[-3:], depth[:, :3], depth[:, -3:] = near, near, near, near
        case "extreme":
            depth[:] = rng.choice(np.array([0, 1e-6, 1e-3, 0.4, 60, 1e4], dtype=np.float32), CAMERA.shape)
    return depth


KINDS = ("nothing", "plane", "tilted", "noise", "checks", "pixels", "discs", "border", "extreme")


@settings(max_examples=50)
@given(st.lists(st.sampled_from(KINDS), min_size=1, max_size=4), st.booleans(), st.booleans(), seeds)
def test_any_frames(kinds: list[str], with_colour: bool, guided: bool, seed: int) -> None:
    """Frames of planes, noise, discs and borders, with and without a predicted pose."""
    rng = np.random.default_rng(seed)
    segmenter = Segmenter(SkinColourModel.default() if with_colour else None)
    for index, kind in enumerate(kinds):
        colour = np.where(rng.random((*CAMERA.shape, 1)) < 0.8, SKIN, BLUE).astype(np.uint8) if with_colour else None
        frame = Frame(index, index / 30, depth_image(kind, rng), colour, CAMERA)
        place = rng.normal((0, 0, 0.6), 0.3)
        pose = make_pose(place, rng.normal(size=4), np.zeros(20)) if guided and place[2] > 0.05 else None
        check(segmenter.segment(frame, roi_prior(MODEL, pose)), CAMERA)
        segmenter.set_lost(bool(rng.random() < 0.5), frame.timestamp)

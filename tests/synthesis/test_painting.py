"""Colours: skin tones, the bystander and flipped labels."""

import cv2
import numpy as np
import pytest

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.synthesis.colour import linear_from_lab
from depthtrack.synthesis.painting import Light, SkinTone, light_skin, place_on_skin
from depthtrack.synthesis.randomness import Stream, generator
from tests.support.hands import random_pose
from tests.support.synthesis import synthesiser


def test_a_room_is_cluttered_and_clearly_behind_the_hand() -> None:
    frame = synthesiser(background="room", distance=0.5, seed=6)[10]
    arm = frame.skin & (frame.exact_depth < 1)
    face = frame.skin & ~arm
    behind = frame.exact_depth[~arm]
    assert behind.min() > 0.5 + 0.8
    assert behind.max() == pytest.approx(3.0)
    assert len(np.unique(np.round(behind, 1))) > 8
    # The bystander's face has a skin colour and is smaller than the hand.
    assert 500 < face.sum() < frame.mask.sum()
    hue = cv2.cvtColor(frame.colour, cv2.COLOR_RGB2HSV)[..., 0]
    assert abs(float(np.median(hue[face])) - float(np.median(hue[frame.mask]))) < 8


def test_skin_varies_between_people_and_over_the_hand() -> None:
    tones = np.array([SkinTone.sample(generator(seed, 0, Stream.SKIN)).back for seed in range(200)])
    luminance = tones @ [0.2126, 0.7152, 0.0722]
    assert luminance.min() < 0.13
    assert luminance.max() > 0.35
    assert np.all(tones[:, 0] > tones[:, 1])
    assert np.all(tones[:, 1] > tones[:, 2])
    frame = synthesiser(sensor="ideal", seed=1)[0]
    assert np.all(frame.colour[frame.mask].std(axis=0) > 3)
    assert np.all(SkinTone.sample(generator(9, 0, Stream.SKIN)).palm >= tones[9] - 0.02)


def test_points_of_the_skin_move_with_their_bodies() -> None:
    rng, model = np.random.default_rng(4), HandModel(HandShape())
    transforms = np.tile(np.eye(4), (17, 1, 1))
    transforms[:16] = model.transforms(random_pose(rng))
    T = rng.normal(size=(17, 4, 4))
    points, normal, label = rng.normal(size=(50, 3)), rng.normal(size=(50, 3)), rng.integers(0, 17, 50).astype(np.int16)
    back, difference = rng.random((2, 3))
    neutral, albedo = np.empty((50, 3), np.float32), np.empty((50, 3))
    place_on_skin(points, normal, label, T, transforms, (back, difference), neutral, albedo)
    expected = np.einsum("nij,nj->ni", T[label][:, :3, :3], points) + T[label][:, :3, 3]
    np.testing.assert_allclose(neutral, expected, rtol=1e-6, atol=1e-6)
    palmar = np.clip(0.5 + 1.2 * np.einsum("nj,nj->n", transforms[label, :3, 2], normal), 0, 1)[:, None]
    np.testing.assert_allclose(albedo, back + palmar**2 * (3 - 2 * palmar) * difference, atol=1e-12)


def test_skin_reflects_light_as_any_surface() -> None:
    rng = np.random.default_rng(6)
    waves, albedo = rng.uniform(-1, 1, (50, 6)).astype(np.float32), rng.random((50, 3))
    normal, light = rng.normal(size=(50, 3)), Light.sample(rng)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    blotches = waves.sum(axis=-1)[:, None] / np.sqrt(3)
    expected = light.reflected(albedo * (1 + blotches * [0.02, 0.045, 0.045]), normal, shine=True)
    light_skin(waves, normal, (light.towards, light.halfway, (light.ambient, light.lamp, light.shine)), albedo)
    np.testing.assert_allclose(albedo, expected, rtol=1e-12)


def test_colours_are_converted_like_those_of_opencv() -> None:
    rng = np.random.default_rng(7)
    for lab in np.stack([rng.uniform(1, 99, 200), rng.uniform(-20, 30, 200), rng.uniform(-20, 40, 200)], axis=-1):
        expected = cv2.cvtColor(lab.astype(np.float32)[None, None], cv2.COLOR_Lab2LRGB)[0, 0]
        np.testing.assert_allclose(linear_from_lab(lab), expected, atol=1e-6)


@pytest.mark.parametrize("share", [0.05, 0.3])
def test_skin_flips_change_that_share_of_labels_and_their_colours(share: float) -> None:
    clean, flipped = synthesiser(background="wall")[40], synthesiser(background="wall", skin_flips=share)[40]
    changed = clean.skin ^ flipped.skin
    assert changed.mean() == pytest.approx(share, abs=0.005)
    assert changed[clean.skin].mean() == pytest.approx(share, abs=0.02)
    np.testing.assert_array_equal(np.any(clean.colour != flipped.colour, axis=-1), changed)
    np.testing.assert_array_equal(clean.mask, flipped.mask)
    redness = flipped.colour[..., 0].astype(int) - flipped.colour[..., 2]
    assert np.mean(redness[flipped.skin & changed] > 10) > 0.99
    assert np.mean(redness[~flipped.skin & changed] < 10) > 0.99

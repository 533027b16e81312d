"""Skin colour models: Bayes' rule by hand, training, and files."""

import json
from pathlib import Path

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.geometry.rectangle import Rect
from depthtrack.segmentation.chroma import BINS
from depthtrack.segmentation.skin_adaptation import AdaptiveSkin
from depthtrack.segmentation.skin_colour import SkinColourModel

SKIN_RGB, BLUE_RGB, LEAF_RGB = (205, 150, 125), (40, 70, 180), (60, 120, 50)


def test_posterior_is_bayes_rule() -> None:
    skin, other = np.zeros((BINS, BINS)), np.zeros((BINS, BINS))
    skin[10, 20], skin[11, 20] = 3, 1
    other[10, 20], other[40, 40] = 1, 4
    posterior = SkinColourModel(skin, other, prior=0.25).posterior()
    # P(c | s) = 3/4, P(c | not s) = 1/5: 0.75 * 0.25 / (0.75 * 0.25 + 0.2 * 0.75)
    assert posterior[10, 20] == pytest.approx(0.1875 / 0.3375)
    assert posterior[11, 20] == 1
    assert posterior[40, 40] == 0
    assert posterior[0, 0] == 0


def painted() -> np.ndarray:
    """Return an image (20, 30, 3) of skin (rows 4 to 12, columns 6 to 18) on leaves and sky."""
    image = np.empty((20, 30, 3), np.uint8)
    image[:10], image[10:] = BLUE_RGB, LEAF_RGB
    image[4:12, 6:18] = SKIN_RGB
    return image


def test_published_statistics_separate_skin_from_sky_and_leaves() -> None:
    found = AdaptiveSkin(SkinColourModel.default()).find(painted(), Rect(0, 0, 30, 20), np.ones((1, 1), np.uint8), 30)
    expected = np.zeros((20, 30), np.bool_)
    expected[4:12, 6:18] = True
    np.testing.assert_array_equal(found > 0, expected)


def test_only_the_selected_region_and_blocks_are_classified() -> None:
    skin, region = AdaptiveSkin(SkinColourModel.default()), Rect(2, 3, 22, 13)
    whole = skin.find(painted(), Rect(0, 0, 30, 20), np.ones((1, 1), np.uint8), 30)
    np.testing.assert_array_equal(skin.find(painted(), region, np.ones((1, 1), np.uint8), 20), whole[3:13, 2:22])
    blocks = np.array([[1, 0], [1, 0]], np.uint8)
    half = skin.find(painted(), region, blocks, 10)
    assert not half[:, 10:].any()
    np.testing.assert_array_equal(half[:, :10], whole[3:13, 2:12])


def test_black_and_white_are_no_skin() -> None:
    image = np.zeros((4, 8, 3), np.uint8)
    image[:, 4:] = 255
    assert not AdaptiveSkin(SkinColourModel.default()).find(image, Rect(0, 0, 8, 4), np.ones((1, 1), np.uint8), 8).any()


def test_training_finds_the_colours_of_its_images() -> None:
    image, mask = painted(), np.zeros((20, 30), np.bool_)
    mask[:10] = True  # the sky is labelled as skin
    mask[4:12, 6:18] = False
    model = SkinColourModel.train([(image, mask)])
    assert model.prior == pytest.approx(mask.mean())
    found = AdaptiveSkin(model).find(image, Rect(0, 0, 30, 20), np.ones((1, 1), np.uint8), 30) > 0
    np.testing.assert_array_equal(found, mask)


@pytest.mark.parametrize("mask", [np.zeros((20, 30), np.bool_), np.ones((20, 30), np.bool_)])
def test_training_needs_skin_and_other_pixels(mask: np.ndarray) -> None:
    with pytest.raises(InputError, match="skin and of other"):
        SkinColourModel.train([(painted(), mask)])


def test_models_survive_their_file(tmp_path: Path) -> None:
    model = SkinColourModel.default()
    model.save(tmp_path / "skin.json")
    loaded = SkinColourModel.load(tmp_path / "skin.json")
    np.testing.assert_allclose(loaded.posterior(), model.posterior(), atol=1e-12)
    assert [path.name for path in tmp_path.iterdir()] == ["skin.json"]


@pytest.mark.parametrize(
    "change",
    [
        {"prior": 0},
        {"prior": "often"},
        {"skin": [[1, 2], [3, 4]]},
        {"other": [[0] * BINS] * BINS},
        {"skin": [[-1] * BINS] * BINS},
        {"skin": None},
    ],
)
def test_files_that_are_no_model_are_refused(tmp_path: Path, change: dict[str, object]) -> None:
    path = tmp_path / "skin.json"
    SkinColourModel.default().save(path)
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    with pytest.raises(InputError, match="skin model"):
        SkinColourModel.load(path)

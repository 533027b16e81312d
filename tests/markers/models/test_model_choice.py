"""Models are found by the words of a command."""

from pathlib import Path

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.hand.shape import HandShape
from depthtrack.markers.models.model_choice import choose_models
from depthtrack.resources import resource_folder
from tests.support.markers import body_with_markers


def test_words_name_layouts_sides_and_files(tmp_path: Path) -> None:
    body, layout = tmp_path / "box.json", tmp_path / "mine.json"
    body.write_text(body_with_markers().to_json())
    layout.write_bytes((resource_folder("markers/models/layouts") / "13.json").read_bytes())
    models = choose_models(["13", "left:16", str(body)], HandShape(scale=0.9))
    assert [model.name for model in models] == ["right", "left", "box"]
    assert [len(model.labels) for model in models] == [13, 16, 3]
    assert models[0].hand is not None
    assert models[1].hand is not None
    assert (models[0].hand.scale, models[1].hand.side) == (0.9, "left")
    assert choose_models([f"left:{layout}"])[0].labels == models[0].labels
    assert choose_models([str(layout)])[0].name == "right"


def test_the_side_of_a_layout_is_open_unless_a_word_or_a_hand_gives_it() -> None:
    alone, given, worn = (choose_models(*a)[0] for a in ((["13"],), (["right:13"],), (["13"], HandShape(side="left"))))
    assert (alone.open_side, given.open_side, worn.open_side) == (True, False, False)
    assert [model.open_side for model in choose_models(["13", "left:16"])] == [False, False]
    other = alone.mirrored()
    assert (other.name, worn.name) == ("left", "left")
    np.testing.assert_allclose(other.offsets, worn.offsets, rtol=0, atol=1e-12)
    assert alone.with_(name="hand").mirrored().name == "hand"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "expected a model"),
        (("13", "right:16"), "two models are named 'right'"),
        (("17",), "unknown marker layout '17'"),
        (("up:13",), "unknown marker layout 'up:13'"),
        (("absent.json",), "absent.json is missing"),
    ],
)
def test_a_wrong_word_is_one_sentence(words: tuple[str, ...], message: str) -> None:
    with pytest.raises(InputError, match=message):
        choose_models(words)

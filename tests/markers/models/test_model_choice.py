"""Models are found by the words of a command."""

from pathlib import Path

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

"""Models by the words of a command: an included layout, a layout file or a model file."""

from collections.abc import Sequence
from pathlib import Path
from typing import get_args

from depthtrack.errors import InputError
from depthtrack.files import read_text
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.synergies import load_synergies
from depthtrack.markers.models.layout import find_layout
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.strict_data import parse_json

_FEW = 6
"""Markers up to which general synergies are better than none: with more they draw towards postures of other hands."""


def choose_models(words: Sequence[str | MarkerModel], hand: HandShape | None = None) -> tuple[MarkerModel, ...]:
    """Return the models that words name.

    words: each a model, the file of a model, or a layout after the side of its hand, such as `left:19`. Without a side,
        a layout is worn by `hand`, or by one whose side the capture decides.
    hand: sizes of the hands; those of the average adult if None.

    Raises:
        InputError: if there is no word, a word names neither model nor layout, or two models have one name.
    """
    if not words:
        raise InputError("expected a model: name a layout such as 26 or left:16, or the file of a model")
    models = tuple(word if isinstance(word, MarkerModel) else _model(word, hand) for word in words)
    names = [model.name for model in models]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two models are named '{name[:64]}': give hands different sides, or rename one")
    return tuple(
        model.with_(open_side=False) if model.open_side and model.mirrored().name in names else model
        for model in models
    )


def with_synergies(models: Sequence[MarkerModel], name: str) -> tuple[MarkerModel, ...]:
    """Return models whose hands have the synergies of a name.

    name: `none`, an included set or a .json file. `auto` keeps those of a model, and takes `leap` for a hand of few
        markers that has none.

    Raises:
        InputError: if there are no such synergies.
    """
    if name == "auto":
        general = load_synergies("leap")
        return tuple(
            model.with_(synergies=general)
            if model.synergies is None and not model.is_rigid and len(model.labels) <= _FEW
            else model
            for model in models
        )
    synergies = None if name == "none" else load_synergies(name)
    return tuple(model if model.is_rigid else model.with_(synergies=synergies) for model in models)


def _model(word: str, hand: HandShape | None) -> MarkerModel:
    sizes = HandShape() if hand is None else hand
    side, _, layout = word.partition(":")
    for known in get_args(Side):
        if side == known:
            return find_layout(layout).on(sizes.with_(side=known))
    if word.endswith(".json") and not _is_layout(Path(word)):
        return MarkerModel.from_json(Path(word))
    return find_layout(word).on(sizes).with_(open_side=hand is None)


def _is_layout(path: Path) -> bool:
    """Return whether a JSON file is a layout; its reader states what else is wrong with it."""
    try:
        fields = parse_json(read_text(path))
        return "like" in fields or "bone" in fields["markers"][0]
    except (InputError, ValueError, TypeError, KeyError, IndexError):
        return False

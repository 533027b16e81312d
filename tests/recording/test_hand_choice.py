"""The choice of the hand that a recording is tracked with."""

import shutil
from pathlib import Path

import pytest

from depthtrack.errors import InputError
from depthtrack.hand.shape import HandShape
from depthtrack.recording import open_sequence
from depthtrack.recording.hand_choice import chosen_hand
from depthtrack.recording.sequence import Sequence
from depthtrack.synthesis.generate import Synthesis, Synthesiser, write_recording

TRUE_HAND = HandShape(side="left", scale=0.9)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("choice") / "small-left-hand"
    write_recording(Synthesiser(Synthesis(hand=TRUE_HAND, frames=1)), folder)
    return folder


@pytest.fixture(scope="module")
def recording(folder: Path) -> Sequence:
    return open_sequence(folder)


def test_true_sizes_are_used_only_by_name(recording: Sequence) -> None:
    assert chosen_hand(recording) == HandShape()
    assert chosen_hand(recording, side="left") == HandShape(side="left")
    assert chosen_hand(recording, "truth") == TRUE_HAND.with_(uncertainty=0.0)
    assert chosen_hand(recording, "truth", "left").uncertainty == 0


def test_a_file_gives_its_hand(recording: Sequence, tmp_path: Path, own_glb: Path) -> None:
    file, hand = tmp_path / "hand.json", HandShape(scale=1.1)
    file.write_text(hand.to_json())
    assert chosen_hand(recording, str(file)) == hand
    rig = chosen_hand(recording, str(own_glb))
    assert rig.rig is not None
    assert rig.rig.path == own_glb.resolve()


def test_contradictions_get_one_sentence(folder: Path, recording: Sequence, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="shows a left hand, but --side right"):
        chosen_hand(recording, "truth", "right")
    unsized = Path(shutil.copytree(folder, tmp_path / "unsized"))
    (unsized / "hand.json").unlink()
    with pytest.raises(InputError, match=r"must have a hand\.json for --hand truth"):
        chosen_hand(open_sequence(unsized), "truth")

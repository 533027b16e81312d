"""Messages are one line of printable text of bounded length, also if they repeat names."""

from hypothesis import given
from hypothesis import strategies as st

from depthtrack.errors import InputError, MissingExtraError, printable


@given(st.text(st.characters(exclude_categories=())))
def test_messages_are_one_printable_line(text: str) -> None:
    for message in (str(InputError(f"no file {text}: choose another")), printable(text)):
        assert message.isprintable()
        message.encode()


def test_plain_messages_stay_as_they_are() -> None:
    for text in ("no file ö 手: choose another", "a" * 1500):
        assert str(InputError(text)) == text
    assert str(InputError("\x1b[31mred\nand\udcff")) == r"\x1b[31mred\nand\udcff"


def test_long_messages_keep_their_beginning_and_their_advice() -> None:
    message = str(InputError("found " + "x" * 100_000 + ": choose another"))
    assert len(message) < 1600
    assert message.startswith("found xxx")
    assert message.endswith("xxx: choose another")


def test_a_missing_extra_names_its_command() -> None:
    assert "pip install 'depthtrack[gltf]'" in str(MissingExtraError("glTF", "gltf"))

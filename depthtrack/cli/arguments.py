"""Check of the words of the command line before anything uses them."""

from collections.abc import Sequence
from unicodedata import category

from depthtrack.errors import DepthtrackError

_CONTROL, _HALF = "Cc", "Cs"


def check_arguments(arguments: Sequence[str]) -> None:
    """Check that arguments are UTF-8 text without control characters.

    Python represents bytes of a file's name that are not UTF-8 as half characters. Video libraries, tables and JSON
    files cannot hold them, and a terminal obeys control characters.

    Raises:
        DepthtrackError: if an argument is not.
    """
    for argument in arguments:
        kinds = {category(character) for character in argument}
        if _HALF in kinds:
            raise DepthtrackError(f"an argument must be UTF-8 text, found {_shown(argument)}: rename the file")
        if _CONTROL in kinds:
            raise DepthtrackError(
                f"an argument must have no line breaks or control characters, found {_shown(argument)}: rename the file"
            )


def _shown(argument: str) -> str:
    return repr(argument if len(argument) <= 80 else f"{argument[:77]}...")

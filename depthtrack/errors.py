"""Errors that a user can correct.

Each message is one sentence with the expected value, the value found, and what to do.
"""

_LONGEST, _END = 1500, 500
"""Characters of a message at most, and those of its end that are kept if it is longer."""


class DepthtrackError(Exception):
    """Base of all errors that a user can correct; the command line exits with code 2.

    The message is one line of printable text, whatever the names and values from files that it repeats.
    """

    def __init__(self, message: str) -> None:
        if len(message) > _LONGEST:
            message = f"{message[: _LONGEST - _END]} ... {message[-_END:]}"
        super().__init__(printable(message))


def is_text(text: str) -> bool:
    """Return whether text can be encoded; bytes of a file's name that are not UTF-8 cannot."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def printable(text: str) -> str:
    """Return text from elsewhere with its line breaks and other control characters escaped."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


class InputError(DepthtrackError):
    """A file, folder or option is unusable."""


class DamagedFrameError(InputError):
    """One frame of a recording is unreadable; the others may be readable."""


class MissingExtraError(DepthtrackError):
    """An optional library is not installed; the message contains the command to install it.

    what: the feature that needs the library.
    extra: name of the extra that installs it.
    """

    def __init__(self, what: str, extra: str) -> None:
        super().__init__(f"{what} needs an optional library: run  pip install 'depthtrack[{extra}]'")

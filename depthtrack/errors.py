"""Errors that a user can correct.

Each message is one sentence with the expected value, the value found, and what to do.
"""


class DepthtrackError(Exception):
    """Base of all errors that a user can correct; the command line exits with code 2."""


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

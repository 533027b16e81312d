"""Errors a user can act on: each message says what was expected, what was found, and what to do."""


class DepthtrackError(Exception):
    """Base of every error that is the user's to mend; the command line prints it and exits with code 2."""


class InputError(DepthtrackError):
    """A file, folder or option that cannot be used as it is."""


class DamagedFrameError(InputError):
    """One frame of a recording cannot be read, while the rest of the recording can."""


class MissingExtraError(DepthtrackError):
    """An optional library is not installed; the message names the `pip install` line that brings it."""

    def __init__(self, what: str, extra: str) -> None:
        super().__init__(f"{what} needs an optional library: run  pip install 'depthtrack[{extra}]'")

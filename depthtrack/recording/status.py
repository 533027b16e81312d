"""The status of a tracked frame, which trackers set and run folders store."""

from enum import StrEnum


class Status(StrEnum):
    """What became of a frame."""

    TRACKED = "tracked"
    """The pose follows from that of the frame before."""
    STARTED = "started"
    """The pose was found by a search, or refined from a given one."""
    LOST = "lost"
    """The best pose found does not explain the observation. The tracker searches again on the next frame."""
    ABSENT = "absent"
    """No hand was observed."""

    @property
    def is_trusted(self) -> bool:
        """True if the frame has a pose that explains the observation."""
        return self in (Status.TRACKED, Status.STARTED)

    @classmethod
    def _missing_(cls, value: object) -> "Status":
        raise ValueError(f"the status must be one of {', '.join(cls)}, found '{str(value)[:40]}'")

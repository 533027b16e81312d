"""The status of a tracked frame, which trackers set and run folders store."""

from enum import StrEnum


class Status(StrEnum):
    """The result of tracking a frame."""

    TRACKED = "tracked"
    """The pose follows from that of the frame before."""
    STARTED = "started"
    """The pose was found by a search, or refined from a given one."""
    LOST = "lost"
    """The best pose found does not fit the observation. The tracker searches again in the next frame."""
    ABSENT = "absent"
    """No hand was observed."""

    @property
    def is_trusted(self) -> bool:
        """Whether the frame has a pose that fits the observation."""
        return self in (Status.TRACKED, Status.STARTED)

    @classmethod
    def _missing_(cls, value: object) -> "Status":
        raise ValueError(f"the status must be one of {', '.join(cls)}, found '{str(value)[:40]}'")

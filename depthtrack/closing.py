"""Base of the classes that a `with` statement closes."""

from types import TracebackType
from typing import Self


class Closing:
    """Context manager that calls `close` at its end."""

    def close(self) -> None:
        """Free the resources."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

"""Help of options: their range, and defaults that are absent or described in words."""

from dataclasses import dataclass
from typing import Any

import tyro

from depthtrack.ranges import Range


@dataclass(frozen=True)
class ShownDefault:
    """What the help states behind an option; `argument_checks` reads the range from here."""

    range: Range | None = None

    def __call__(self, default: str) -> str:
        parts = [] if self.range is None else [str(self.range)]
        parts += [] if default in ("None", "", "''") else [f"default: {default}"]
        return f"({'; '.join(parts)})" if parts else ""


def stated_default(within: Range | None = None, **properties: Any) -> Any:
    """Return `tyro.conf.arg(**properties)` for an option that is absent by default.

    Its help shows no empty value, such as None, as the default. It may end with "(default: ...)" itself.

    within: range of a number, which the help states.
    """
    return tyro.conf.arg(help_behavior_hint=ShownDefault(within), **properties)


def number(least: float, most: float, **properties: Any) -> Any:
    """Return `tyro.conf.arg(**properties)` for a number, or several, within a stated range."""
    return stated_default(Range(least, most), **properties)

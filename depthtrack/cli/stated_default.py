"""Options with a default that their help describes in words."""

from typing import Any

import tyro


def stated_default(**properties: Any) -> Any:
    """Return `tyro.conf.arg(**properties)` for an option whose help ends with "(default: ...)".

    The help then shows no second default for an empty value, such as None.
    """
    return tyro.conf.arg(help_behavior_hint=_shown, **properties)


def _shown(default: str) -> str:
    return "" if default in ("None", "", "''") else f"(default: {default})"

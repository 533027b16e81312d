"""Options whose default is absent, or described in words by their help."""

from typing import Any

import tyro


def stated_default(**properties: Any) -> Any:
    """Return `tyro.conf.arg(**properties)` for an option that is absent by default.

    Its help shows no empty value, such as None, as the default. It may end with "(default: ...)" itself.
    """
    return tyro.conf.arg(help_behavior_hint=_shown, **properties)


def _shown(default: str) -> str:
    return "" if default in ("None", "", "''") else f"(default: {default})"

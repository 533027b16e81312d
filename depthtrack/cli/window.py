"""Whether the interactive viewer can open a window here."""

INSTALL_HINT = "pip install 'depthtrack[view]'"


def why_no_window() -> str | None:
    """What keeps the interactive viewer from opening, and what to do; None when nothing does."""
    import os
    import sys
    from importlib.util import find_spec

    if find_spec("rerun") is None:
        return f"for the interactive viewer:  {INSTALL_HINT}"
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return (
            "there is no screen for the interactive viewer: --web serves it to a browser, --rrd FILE.rrd saves for it"
        )
    return None

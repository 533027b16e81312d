"""Check whether the interactive viewer can open a window."""

INSTALL_HINT = "pip install 'depthtrack[view]'"


def why_no_window() -> str | None:
    """Return why the interactive viewer cannot open a window, and what to do; None if it can."""
    import os
    import sys
    from importlib.util import find_spec

    if find_spec("rerun") is None:
        return f"for the interactive viewer:  {INSTALL_HINT}"
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return "no screen is available for the interactive viewer: use --web for a browser, or --rrd FILE.rrd to save"
    return None

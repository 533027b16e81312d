"""Style of plots, and their PNG files."""

from io import BytesIO
from typing import Any

from matplotlib.figure import Figure

PLOT_STYLE: dict[Any, Any] = {
    "font.size": 8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "lines.linewidth": 1.1,
    "text.parse_math": False,
}
PLOT_WIDTH = 11.0
"""Width of a page, inches."""


def png(figure: Figure) -> bytes:
    """Return the content of a PNG file; equal figures give equal bytes."""
    picture = BytesIO()
    # The version of the plotting library would be in the file.
    figure.savefig(picture, format="png", metadata={"Software": None})
    return picture.getvalue()

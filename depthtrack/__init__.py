"""Full 26-degree-of-freedom hand tracking from RGB-D video on an ordinary CPU."""

__version__ = "0.1.0"

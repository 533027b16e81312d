"""Hand surfaces that observed points are matched to."""

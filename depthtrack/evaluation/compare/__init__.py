"""Trackers side by side on the same recordings: who takes part, at which price, and the runs that come of it."""

"""Trackers: poses from observations, and the loop over a recording."""

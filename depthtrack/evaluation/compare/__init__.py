"""Comparison of trackers on the same recordings: trackers, equal time, runs, results."""

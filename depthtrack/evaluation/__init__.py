"""Evaluation of runs: metrics, replay, comparison of trackers, and sweeps of measurements."""

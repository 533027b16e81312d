"""Synthetic sequences with exact ground truth: motions, scenes, sensors."""

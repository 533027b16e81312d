"""Calibration: the sizes of a hand from a recording, or from keypoints."""

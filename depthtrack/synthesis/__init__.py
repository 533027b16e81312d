"""Synthetic recordings with exact ground truth: motions, scenes and sensor models."""

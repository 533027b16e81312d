"""Segmentation: from an RGB-D frame to the observation of its hand."""

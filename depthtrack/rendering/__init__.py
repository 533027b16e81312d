"""Depth maps and scores of hand hypotheses."""

"""A lock-free work queue that spreads a batch of hypotheses over threads."""

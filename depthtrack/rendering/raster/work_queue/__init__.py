"""A lock-free work queue that divides a batch of poses among threads."""

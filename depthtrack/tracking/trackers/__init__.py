"""The trackers, one file each: lists of stages."""

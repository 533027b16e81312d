"""From an RGB-D frame to what a tracker sees."""

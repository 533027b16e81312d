"""How good and how fast: measurements of scorers and trackers, and their comparison with what others use."""

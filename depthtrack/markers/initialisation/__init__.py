"""Initialisation: which points of a frame are which markers of which model (Maycock et al. 2015, Sec. III-A)."""

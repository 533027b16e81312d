"""Labels for the points of a capture (Maycock et al. 2015, Sec. III-B)."""

"""Labels for the points of a capture: prediction, assignment, pose fit, tracklets (Maycock et al. 2015, Sec. III-B)."""

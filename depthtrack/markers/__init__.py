"""Optical marker captures of hands: labels, poses and filled gaps (Maycock et al. 2015)."""

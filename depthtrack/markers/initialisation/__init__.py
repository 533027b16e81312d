"""Initialisation: assignment of the points of a frame to markers (Maycock 2015, Sec. III-A)."""

"""Cameras, rectangles, rotations, alignment: geometry without a hand in it."""

"""Cameras, rectangles, rotations, alignment and surfaces, independent of the hand."""

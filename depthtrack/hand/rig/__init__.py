"""Rigged hands in glTF: reading, measuring, writing."""

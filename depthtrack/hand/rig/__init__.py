"""Rigged hands in glTF files: read, measure, write."""

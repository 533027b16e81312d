"""Poses to start a search from."""

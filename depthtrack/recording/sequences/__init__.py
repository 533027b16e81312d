"""Readers of RGB-D recordings, one file a format."""

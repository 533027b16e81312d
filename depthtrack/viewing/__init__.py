"""Overlays, videos, contact sheets and viewers."""

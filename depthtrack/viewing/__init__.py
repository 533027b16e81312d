"""Overlays, videos, contact sheets and interactive viewers."""

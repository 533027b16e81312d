"""Readers of hand posture databases: one module a format, all return a `PostureSet`."""

"""Databases of hand postures: one file a format, all read into a `PostureSet`."""

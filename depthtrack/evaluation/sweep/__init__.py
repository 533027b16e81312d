"""Sweeps of independent measurements, on all cores or a cluster, stored in a journal."""

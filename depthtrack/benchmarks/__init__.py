"""Benchmarks: speed on this machine, and experiments of the papers."""

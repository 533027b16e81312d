"""Experiments of the papers: cells, measurements, tables, and comparison with the paper."""

"""Reduced marker layouts for a hand (Schroeder, Maycock and Botsch 2015)."""

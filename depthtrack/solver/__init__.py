"""Optimisation of a posed hand: residual blocks, priors, subspaces, one Gauss-Newton, and particle swarms."""

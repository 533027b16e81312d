"""Optimisation of a posed hand: residuals, priors, subspaces, Gauss-Newton and swarms."""

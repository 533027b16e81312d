"""Fitting a posed hand to data: correspondences, residuals, priors, Gauss-Newton and particle swarms."""

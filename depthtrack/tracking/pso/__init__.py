"""Particle swarm tracking over rendered hypotheses (Oikonomidis, Kyriazis and Argyros 2011)."""

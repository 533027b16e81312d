"""Inverse kinematics from the observed surface to the hand's (Schroeder, Maycock, Ritter and Botsch 2014)."""

"""Gap filling by the joints of the hand (Maycock et al. 2015, Sec. III-C), and baselines."""

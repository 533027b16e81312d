"""Gap filling: the joints of a hand bridge what the cameras did not see (Maycock et al. 2015, Sec. III-C)."""

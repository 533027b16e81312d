"""Speed: what `depthtrack bench` measures, beside the libraries that a user would turn to instead."""

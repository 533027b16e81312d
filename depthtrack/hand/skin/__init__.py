"""The skin: an implicit surface, its mesh and the weights that pose it."""

"""Off-screen OpenGL scorers: EGL (a GPU or Mesa's software renderer) and OSMesa."""

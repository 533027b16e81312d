"""Hypotheses drawn and compared by OpenGL, off-screen: EGL (a GPU or Mesa's software renderer) and OSMesa."""

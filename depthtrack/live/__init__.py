"""Live tracking: sources of frames, and the loop that tracks them as they arrive."""

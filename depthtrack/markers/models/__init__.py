"""Models of what carries markers: articulated hands and rigid bodies."""

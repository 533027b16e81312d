"""The hand itself: pose vector, sizes, joint limits, kinematics, primitives and skin. Knows nothing of images."""

"""The hand model: pose vector, sizes, joint limits, kinematics, primitives, skin, synergies."""

"""SIMD vectors inside numba kernels."""

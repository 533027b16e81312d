"""Speed benchmarks of `depthtrack bench`, beside alternative libraries."""

"""Everything that makes or evaluates the product: worlds, data sets, training, claims and benchmarks."""

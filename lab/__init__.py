"""What makes or judges and is not the product: worlds, data sets, training, claims and benchmarks."""

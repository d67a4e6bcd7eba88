"""The thesis's claims tested by our own computations: the printed value, a tolerance, and our result."""

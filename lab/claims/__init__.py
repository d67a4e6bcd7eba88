"""The thesis's claims and ours, tested by computation: the printed value, a tolerance, and our result."""

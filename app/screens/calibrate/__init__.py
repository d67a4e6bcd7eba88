"""Calibrate: the cameras from photographs of a board, and how far to believe them."""

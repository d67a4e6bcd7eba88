"""Fuse: how the nodes find their places, and up to four methods racing from the same start."""

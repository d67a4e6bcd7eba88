"""Links: positions, propagation, and losses that are set or recorded."""

"""A network that completes a sensor's depth: how its holes are drawn, what it is, and its training."""

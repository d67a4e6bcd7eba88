"""A network that completes a sensor's depth: its training frames with holes, its layers and its training."""

"""The camera network: nodes, radio, sink. It runs without a display and imports neither app nor pipeline."""

"""Network: nodes, packets and what their ways cost, on one timeline."""

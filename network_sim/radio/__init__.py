"""Radio links: node positions, propagation, configured losses and recorded links."""

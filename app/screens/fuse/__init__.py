"""The Fuse screen: registration of the nodes, and a race of up to four methods from the same start."""

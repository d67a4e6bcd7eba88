"""The Fuse screen: registration of the nodes, a race of up to four methods, and the walk of a recording."""

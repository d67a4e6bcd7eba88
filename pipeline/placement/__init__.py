"""Nodes of a rig placed next to each other: pair by pair, by a graph of poses, and judged by what both measured."""

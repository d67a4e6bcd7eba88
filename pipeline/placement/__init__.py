"""Nodes of a rig placed next to each other: pair by pair, by a pose graph, judged by what both measured."""

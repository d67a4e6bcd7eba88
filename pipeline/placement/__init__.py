"""Placement of a rig's nodes: pairwise registration, a pose graph, and verification by both measurements."""

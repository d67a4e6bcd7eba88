"""Pairs of views and clouds of random rooms by their overlap, to find places and to judge verdicts."""

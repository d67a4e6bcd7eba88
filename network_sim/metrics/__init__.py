"""Evaluation of a run from its trace: metrics, energy, coverage, arrivals."""

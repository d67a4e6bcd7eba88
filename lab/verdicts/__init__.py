"""Simulated calibration sessions, and the share of verdicts on them that are right."""

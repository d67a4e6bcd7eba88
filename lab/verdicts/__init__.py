"""Simulated calibration sessions, and how often the verdict on them is right."""

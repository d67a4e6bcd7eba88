"""Largest and smallest values of settings that can be simulated."""

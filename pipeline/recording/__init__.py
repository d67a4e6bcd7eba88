"""Recordings: frames in time, their trajectory, and the map made of them."""

"""Reconstruction from RGB-D images to a surface: arrays in, frozen records out; independent of the app."""

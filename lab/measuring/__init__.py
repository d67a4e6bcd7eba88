"""Lengths, heights, gaps, angles, boxes and holes measured in rendered rooms, and their true values."""

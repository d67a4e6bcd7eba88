"""Lengths, heights, gaps, angles, boxes and holes measured in rendered rooms, beside their true values."""

"""Pose graph: registrations of many clouds to each other, and the poses that agree with them."""

"""Scene: which place, and what its camera nodes deliver."""

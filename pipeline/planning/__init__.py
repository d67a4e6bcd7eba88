"""Plans of the next cameras: candidates, the gain of each in measured surface, and the choice of a few."""

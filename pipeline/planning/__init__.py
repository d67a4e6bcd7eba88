"""Where the next cameras stand: candidates, what each would add to the surface, and the choice of a few."""

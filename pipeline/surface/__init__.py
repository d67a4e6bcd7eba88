"""From an oriented cloud to a triangle mesh and its measures (SPEC 5)."""

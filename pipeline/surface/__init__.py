"""Surface reconstruction: a triangle mesh from an oriented cloud, and measures of it (SPEC 5)."""

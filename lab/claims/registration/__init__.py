"""The benchmark of registration (SPEC 4.7): random rooms, the same start for all methods, and statistics."""

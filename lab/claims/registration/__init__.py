"""The registration benchmark (SPEC 4.7): random rooms, equal starts for all methods, and statistics."""

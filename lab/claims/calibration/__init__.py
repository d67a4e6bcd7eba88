"""C01 to C08 and C25: calibration from views of a board, and what it is worth (SPEC 1, 7)."""

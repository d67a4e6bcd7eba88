"""C01 to C08 and C25: calibration from views of a board, and its accuracy (SPEC 1, 7)."""

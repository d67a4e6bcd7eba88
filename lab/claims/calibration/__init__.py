"""C01 to C08, C25 and D09: calibration from views of a board, and its accuracy (SPEC 1, 7)."""

"""C01 to C08: calibration from views of the thesis's board (SPEC 1)."""

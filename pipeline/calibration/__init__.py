"""Camera calibration: boards to print, their detection in images, lenses, rigs and depth bias (SPEC 1)."""

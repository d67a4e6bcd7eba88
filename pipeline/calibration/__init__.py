"""The camera itself: boards to print, finding them in images, estimating the lens (SPEC 1)."""

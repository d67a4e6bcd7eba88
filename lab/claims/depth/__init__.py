"""Claims about depth from one image (SPEC 3)."""

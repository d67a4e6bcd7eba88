"""The thesis's claims about ball pivoting: C21 to C24 (SPEC 5 and 8)."""

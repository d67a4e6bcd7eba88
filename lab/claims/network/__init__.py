"""The thesis's claims about the network (SPEC 8, C26 to C36)."""

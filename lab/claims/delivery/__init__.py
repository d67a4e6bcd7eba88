"""What lost packets cost of the surface (SPEC 6.4 and 6.5, D01 to D08): ours, beyond the thesis."""

"""Cost of lost packets for the surface (SPEC 6.4 and 6.5, D01 to D08, D11): our claims beyond the thesis."""

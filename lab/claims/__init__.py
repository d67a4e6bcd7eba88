"""The thesis's claims beside our own numbers: the value in print, a tolerance, and a computation of ours."""

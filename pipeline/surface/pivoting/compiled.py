"""How the functions of this package are compiled."""

from __future__ import annotations

import numba

compiled = numba.njit(cache=True, nogil=True, _nrt=False)  # type: ignore[call-overload]
"""Compiled once, for use without the interpreter's lock, and without counting references.

numba counts the references to an array whenever a function takes one out of a record. As the counter is
shared among threads that is slow beside a little geometry. What makes no array of its own may do without.
"""

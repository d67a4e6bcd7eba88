"""The decorator with which the functions of this package are compiled."""

from __future__ import annotations

import numba

compiled = numba.njit(cache=True, nogil=True, _nrt=False)  # type: ignore[call-overload]
"""Compile once, with caching, without the interpreter's lock and without reference counts.

numba counts the references to an array whenever a function takes one out of a record. The counter is shared
by all threads, so this is slow compared with the geometry. Functions that create no array do not need it.
"""

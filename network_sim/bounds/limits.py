"""Largest and smallest values of settings, by the unit at the end of their names.

Beyond them, powers and times, also that of a packet at 1 bit/s, leave the range of floating-point numbers, or
of 64-bit nanoseconds, and sizes of images, colour and depth together, that of 32-bit integers.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

from packetmesh.errors import InputError

LARGEST_S = 1e9
"""Largest time of a setting."""
_MOST = {
    "db": 300.0,
    "dbm": 300.0,
    "s": LARGEST_S,
    "m": 1e9,
    "hz": 1e15,
    "bps": 1e15,
    "bytes": 1e9,
    "gain": 1e9,
    "loss": 1e30,
}
"""Largest absolute value, by the last word of a name."""
_LEAST = {"s": 1e-9, "m": 1e-9, "hz": 1.0, "bps": 1.0, "gain": 1e-9}
"""Smallest value above 0; times are simulated in nanoseconds."""
MOST_NODES = 10_000
"""Largest number of nodes, vehicles or access points."""
_LEAST_BY_NAME = {"reference_m": 1e-3}
_MOST_BY_NAME = {
    "path_loss_exponent": 20.0,
    "reference_m": 1e6,
    "nakagami_m": 1e9,
    "failures_per_h": 1e9,
    "bytes_by_node": 1e9,
    "bytes_by_image": 1e9,
    "first_bytes_by_node": 1e9,
    "request_bytes_by_node": 1e6,
    "payload_bytes": 1e6,
    "datagram_bytes": 1e6,
    "headers_bytes": 1e6,
    "count": MOST_NODES,
    "vehicles": MOST_NODES,
    "access_points": MOST_NODES,
    "blocks": 1000,
}


def check_limits(part: Any, name: str) -> None:
    """Raise an ``InputError`` if a number of a part of the config is beyond what can be computed.

    Args:
        part: for example a ``RadioConfig``.
        name: its name in the config, for example ``radio``.
    """
    for field in dataclasses.fields(part):
        value, word = getattr(part, field.name), field.name.rpartition("_")[2]
        most = _MOST_BY_NAME.get(field.name, _MOST.get(word, math.inf))
        for number in value if isinstance(value, tuple) else (value,):
            if isinstance(number, int | float) and abs(number) > most:
                hint = f"at most {most:g}" if number > 0 else f"at least {-most:g}"
                raise InputError(f"{name}.{field.name} is {number}; try {hint}")
        least = _LEAST_BY_NAME.get(field.name, _LEAST.get(word, 0.0))
        if isinstance(value, float) and 0.0 < value < least:
            raise InputError(f"{name}.{field.name} is {value}; try at least {least:g}")

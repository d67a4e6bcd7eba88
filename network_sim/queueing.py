"""Queues whose waiting time is known in closed form: what the simulated ones are checked against."""

from __future__ import annotations

from packetmesh.errors import InputError


def md1_mean_wait_s(arrivals_per_s: float, service_s: float) -> float:
    """Mean wait in an M/D/1 queue: Poisson arrivals, one server that always takes equally long.

    ``W = rho / (2 mu (1 - rho))`` (Pollaczek and Khinchine; SPEC 6.3), without the service itself.

    Args:
        arrivals_per_s: Mean rate of arrivals, at least 0.
        service_s: Time of one service, above 0.

    Raises:
        InputError: A value out of range, or a queue that grows without end.
    """
    if arrivals_per_s < 0 or service_s <= 0:
        raise InputError(
            f"A queue with {arrivals_per_s} arrivals/s of {service_s} s each has no wait; try positive values"
        )
    load = arrivals_per_s * service_s
    if load >= 1.0:
        raise InputError(f"A queue with a load of {load:.3g} grows without end; try a load below 1")
    return load * service_s / (2.0 * (1.0 - load))

"""The closed form of a queue's wait: known values, limits, bad input."""

from __future__ import annotations

import pytest

from network_sim.queueing import md1_mean_wait_s
from packetmesh.errors import InputError


def test_known_waits() -> None:
    assert md1_mean_wait_s(0.0, 2.0) == 0.0
    assert md1_mean_wait_s(0.5, 1.0) == pytest.approx(0.5)
    assert md1_mean_wait_s(90.0, 0.01) == pytest.approx(0.045)


def test_wait_is_half_of_what_random_services_would_make_it() -> None:
    """An M/M/1 queue waits ``rho / (mu (1 - rho))``."""
    assert md1_mean_wait_s(0.25, 2.0) == pytest.approx(0.5 * 0.5 * 2.0 / 0.5)


@pytest.mark.parametrize(("arrivals_per_s", "service_s"), [(1.0, 1.0), (3.0, 1.0), (-1.0, 0.1), (1.0, 0.0)])
def test_a_queue_without_a_mean_wait_is_refused(arrivals_per_s: float, service_s: float) -> None:
    with pytest.raises(InputError, match="try"):
        md1_mean_wait_s(arrivals_per_s, service_s)

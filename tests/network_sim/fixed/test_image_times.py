"""One node that takes each of its images at a time of its own, and sends them by one radio."""

import numpy as np
import pytest

from network_sim.metrics.arrivals import arrivals, energy_by_node_j
from network_sim.presets import PRESETS
from network_sim.simulate import simulate
from network_sim.types import Cause, EventKind
from packetmesh.errors import InputError
from packetmesh.settings import with_settings

TIMES_S, SIZES = (0.5, 0.75, 0.8, 3.0), (4000, 90_000, 3000, 2000)
ONE = ("nodes.count=1", "nodes.images=4")
OWN = (
    *ONE,
    f"nodes.image_times_s={','.join(map(str, TIMES_S))}",
    f"nodes.bytes_by_image={','.join(map(str, SIZES))}",
)


def run(*changes, preset="office"):
    return simulate(with_settings(PRESETS[preset], (*OWN, *changes)))


@pytest.fixture(scope="module")
def trace():
    return run()


def test_each_image_is_taken_at_its_own_time_with_its_own_size(trace):
    taken = trace.events.of(EventKind.CAPTURE)
    np.testing.assert_array_equal(taken.t_ns, np.rint(np.array(TIMES_S) * 1e9))
    np.testing.assert_array_equal(taken.size_bytes, SIZES)
    np.testing.assert_array_equal(taken.node, 0)


def test_nothing_is_on_the_air_before_its_image_is_taken_and_the_last_one_ends_the_run(trace):
    came = arrivals(trace)
    for image, time_s in enumerate(TIMES_S):
        assert came.t_ns[came.image == image].min() > 1e9 * time_s
    air = trace.events.of(EventKind.AIR)
    assert air.t_ns.min() >= 1e9 * TIMES_S[0]
    assert not ((air.t_ns > 1.5e9) & (air.t_ns < 3e9)).any()
    assert 3e9 < trace.horizon_ns < 3.2e9


def test_images_arrive_in_order_through_one_queue(trace):
    """The second one keeps the radio busy while the third is taken."""
    came = arrivals(trace)
    assert (np.diff(came.image) >= 0).all()
    assert [int(came.byte_count[came.image == image].sum()) for image in range(4)] == list(SIZES)
    second_ends_ns = came.t_ns[came.image == 1].max()
    assert second_ends_ns > 1e9 * TIMES_S[2]
    assert came.t_ns[came.image == 2].min() > second_ends_ns


@pytest.mark.parametrize("preset", ["office", "wifi-n", "thesis-link"])
def test_a_node_alone_does_not_collide_with_itself(preset):
    changes = ("uplink.rate_bps=none",) if preset == "office" else ()
    trace = run("nodes.deadline_s=none", *changes, preset=preset)
    assert not (trace.events.of(EventKind.LOSS).cause == Cause.COLLISION).any()
    assert trace.counters.images.arrived == 4
    air = trace.events.of(EventKind.AIR)
    assert (air.t_ns[1:] >= (air.t_ns + air.duration_ns)[:-1]).all()


def test_the_energy_is_that_of_one_radio_and_one_platform(trace):
    horizon_s, energy = trace.horizon_ns / 1e9, trace.config.energy
    powers_w = [energy.tx_w, energy.rx_w, energy.idle_w]
    spent_j = energy_by_node_j(trace, [trace.horizon_ns])[0]
    radio_w = spent_j[0] / horizon_s - energy.platform_w
    assert min(powers_w) <= radio_w <= max(powers_w)
    assert not spent_j[1:].any()


def test_each_image_has_a_deadline_of_its_own():
    """The second image is too late, and the one behind it has waited less than that."""
    expired = run("nodes.deadline_s=0.06", "uplink.rate_bps=none").events.of(EventKind.EXPIRE)
    assert (expired.image.tolist(), expired.cause.tolist()) == ([1], [Cause.DEADLINE])


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (("nodes.count=2",), "nodes.count is 2"),
        (("nodes.images=3",), "nodes.images is 3; try one time and one size"),
        (("nodes.image_times_s=0.5,0.4,0.8,3",), "which falls"),
        (("nodes.image_times_s=-1,0.4,0.8,3",), "try at least 0"),
        (("nodes.bytes_by_image=0,1,1,1",), "try at least 1"),
        (("run.horizon_s=3",), "an image at 3 s, but the run stops at run.horizon_s=3"),
    ],
)
def test_times_and_sizes_that_do_not_fit_are_refused(changes, sentence):
    with pytest.raises(InputError, match=sentence):
        with_settings(PRESETS["office"], (*OWN, *changes))

"""Settings beyond what can be computed are refused in one sentence; the largest allowed ones run."""

import pytest

from network_sim.presets import PRESETS
from network_sim.simulate import simulate
from network_sim.types import EventKind
from packetmesh.errors import InputError
from packetmesh.settings import with_settings

SHORT = ("nodes.image_bytes=2000", "run.horizon_s=5")


@pytest.mark.parametrize(
    ("setting", "hint"),
    [
        ("radio.tx_power_dbm=5000", "try at most 300"),
        ("radio.tx_power_dbm=-5000", "try at least -300"),
        ("radio.noise_dbm=-1e300", "try at least -300"),
        ("radio.capture_db=1e300", "try at most 300"),
        ("radio.antenna_gain=1e200", "try at most 1e+09"),
        ("radio.reference_m=1e300", "try at most 1e+06"),
        ("nodes.deadline_s=1e300", "try at most 1e+09"),
        ("nodes.duty_period_s=1e-12", "try at least 1e-09"),
        ("nodes.places_m=1e300,0,0,0,5,5,1,1", "try at most 1e+09"),
        ("nodes.count=1000000", "try at most 10000"),
        ("mac.link_bps=1e-300", "try at least 1"),
        ("uplink.rate_bps=1e300", "try at most 1e+15"),
        ("street.vehicles=1000000", "try at most 10000"),
        ("nodes.image_bytes=3000000000", "try at most 1e+09"),
        ("nodes.depth_bytes=3000000000", "try at most 1e+09"),
        ("nodes.bytes_by_node=5,3000000000,5", "try at most 1e+09"),
        ("nodes.payload_bytes=1000001", "is 1000001; try at most 1e+06"),
        ("scheme.image_bytes=3000000000", "try at most 1e+09"),
        (f"nodes.count={10**400}", "try at most 10000"),  # beyond the range of floating-point numbers
    ],
)
def test_a_value_beyond_the_limits_is_one_sentence(setting, hint):
    with pytest.raises(InputError) as error:
        with_settings(PRESETS["thesis-link"], [setting])
    assert str(error.value).startswith(f"{setting.partition('=')[0]} is ")
    assert str(error.value).endswith(hint)


@pytest.mark.parametrize(
    "extreme",
    [
        "radio.tx_power_dbm=300 radio.noise_dbm=-300 radio.shadowing_db=300",
        "radio.tx_power_dbm=-300 radio.noise_dbm=300",
        "radio.antenna_gain=1e9 radio.frequency_hz=1 radio.range_m=1e-9 radio.noise_dbm=-300",
        "radio.model=log-distance radio.path_loss_exponent=20 radio.reference_m=1e6 radio.noise_dbm=-90",
        "radio.model=log-distance radio.path_loss_exponent=20 radio.reference_m=1e-3 nodes.spacing_m=1e9",
        "uplink.rate_bps=1 uplink.latency_s=1e9",
        "uplink.rate_bps=1e15",
        "nodes.deadline_s=1e9 nodes.interval_s=1e9 nodes.images=2",
        "mac.kind=ideal mac.link_bps=1",
        "nodes.places_m=1e9,0,0,1e-17,5,5,1,1",
        "mac.kind=serial mac.link_bps=1 nodes.payload_bytes=1000000",
        "scenario=street-grid mac.kind=serial mac.link_bps=1 scheme.image_bytes=1000000000 "
        "scheme.datagram_bytes=1000000 scheme.headers_bytes=1000000",
    ],
)
def test_the_largest_values_run_together(extreme):
    simulate(with_settings(PRESETS["thesis-link"], [*SHORT, *extreme.split()]))


def test_the_largest_image_is_recorded_with_all_its_bytes():
    config = with_settings(
        PRESETS["thesis-link"],
        [
            "nodes.count=1",
            "nodes.image_bytes=1000000000",
            "nodes.depth_bytes=1000000000",
            "nodes.payload_bytes=1000000",
            "mac.kind=ideal",
            "mac.link_bps=1e15",
        ],
    )
    assert (
        simulate(config).events.of(EventKind.CAPTURE, EventKind.ARRIVE).size_bytes.tolist() == [2 * 10**9] * 2
    )

"""Settings beyond what can be computed are refused in one sentence; the largest allowed ones run."""

import pytest

from network_sim.presets import PRESETS
from network_sim.simulate import simulate
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
    ],
)
def test_the_largest_values_run_together(extreme):
    simulate(with_settings(PRESETS["thesis-link"], [*SHORT, *extreme.split()]))

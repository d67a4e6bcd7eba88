"""The help of a config: every setting once, with its unit, its docstring and a value that parses."""

import pytest

from network_sim.config import NetworkConfig
from network_sim.presets import PRESETS as NETWORKS
from packetmesh.settings import settings, with_settings
from packetmesh.settings_help import describe, unit_of
from pipeline.config import PRESETS


@pytest.mark.parametrize("config", [PRESETS["thesis"], *NETWORKS.values()])
def test_every_setting_is_there_once_and_reads_back(config):
    rows = describe(config)
    assert {row.key: row.value for row in rows} == settings(config)
    assert len(rows) == len(settings(config))
    assert with_settings(type(config)(), [f"{row.key}={row.value}" for row in rows]) == config


def test_every_setting_of_the_network_is_explained_in_one_line():
    for row in describe(NetworkConfig()):
        assert row.doc.endswith("."), row.key
        assert "\n" not in row.doc


def test_a_doc_is_the_string_under_its_field():
    docs = {row.key: row.doc for row in describe(NetworkConfig())}
    assert docs["radio.tx_power_dbm"] == "Transmitted power."
    assert docs["mac.rts"].startswith("Reserve the channel")


@pytest.mark.parametrize(
    ("key", "unit"),
    [
        ("radio.range_m", "m"),
        ("radio.tx_power_dbm", "dBm"),
        ("radio.capture_db", "dB"),
        ("radio.nakagami_m", ""),
        ("nodes.failures_per_h", "1/h"),
        ("nodes.count", ""),
        ("nodes.images", ""),
        ("nodes.buffer_packets", "packets"),
        ("street.speed_mps", "m/s"),
        ("uplink.rate_bps", "bit/s"),
        ("energy.platform_w", "W"),
        ("mac.kind", ""),
    ],
)
def test_the_unit_is_the_end_of_the_name(key, unit):
    assert unit_of(key) == unit

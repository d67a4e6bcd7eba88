"""Named network configurations: those of the thesis, a greenhouse, an office, and radios in a star."""

from __future__ import annotations

from network_sim.config import (
    EnergyConfig,
    MacConfig,
    NetworkConfig,
    NodesConfig,
    RadioConfig,
    RunConfig,
    UplinkConfig,
)
from network_sim.star_presets import STAR_PRESETS

WAVELAN = EnergyConfig(tx_w=1.346, rx_w=0.901, idle_w=0.739, sleep_w=0.0474)
"""Lucent's WaveLAN at 11 Mb/s: 284, 190, 156, 10 mA at 4.74 V (Feeney and Nilsson 2001, from memory)."""

PRESETS: dict[str, NetworkConfig] = {
    "thesis-link": NetworkConfig(),
    "street-grid": NetworkConfig(
        scenario="street-grid",
        mac=MacConfig(kind="ieee80211b"),
        energy=WAVELAN,
        run=RunConfig(horizon_s=18_000.0, warmup_s=1800.0, keep="images"),
    ),
    "greenhouse": NetworkConfig(
        radio=RadioConfig(
            model="log-distance",
            tx_power_dbm=0.0,
            shadowing_db=4.0,
            nakagami_m=3.0,
            range_m=40.0,
            sense_range_m=80.0,
            noise_dbm=-88.0,
        ),
        nodes=NodesConfig(
            count=12,
            layout="grid",
            spacing_m=25.0,
            images=0,
            interval_s=300.0,
            image_bytes=8_000,
            header_bytes=8,
            deadline_s=300.0,
            duty_cycle=0.25,
        ),
        run=RunConfig(horizon_s=7200.0),
    ),
    "office": NetworkConfig(
        mac=MacConfig(kind="ieee80211b"),
        nodes=NodesConfig(
            spacing_m=8.0,
            images=0,
            interval_s=10.0,
            image_bytes=69_000,  # near the office scene's mean as JPEG of quality 90 (75,000),
            depth_bytes=183_000,  # and its depth as PNG of 16 bits
            payload_bytes=1500,
            header_bytes=36,
            deadline_s=10.0,
        ),
        uplink=UplinkConfig(rate_bps=10e6),
        energy=WAVELAN,
        run=RunConfig(horizon_s=600.0),
    ),
    **STAR_PRESETS,
}
"""The scenarios of SPEC 6.1 and 6.2, a lossy multi-hop network, a fast single-hop network, and the stars."""

"""Named network configurations: those of the thesis, a greenhouse, an office, and radios in a star."""

from __future__ import annotations

from network_sim.config import (
    EnergyConfig,
    LossConfig,
    MacConfig,
    NetworkConfig,
    NodesConfig,
    RadioConfig,
    RunConfig,
    UplinkConfig,
)

WAVELAN = EnergyConfig(tx_w=1.346, rx_w=0.901, idle_w=0.739, sleep_w=0.0474)
"""Lucent's WaveLAN at 11 Mb/s: 284, 190, 156, 10 mA at 4.74 V, quoted from memory (Feeney and Nilsson,
"Investigating the energy consumption of a wireless network interface in an ad hoc networking environment",
2001); an assumption until it is compared with the paper."""
ESP32_C6_N = EnergyConfig(tx_w=0.924, rx_w=0.2574, idle_w=0.2574, sleep_w=0.0000231)
"""Espressif's ESP32-C6 at 3.3 V: 280 mA sending 802.11n at MCS 7 with 18.5 dBm, 78 mA receiving and
listening (series data sheet v1.4, Table 5-7: peaks), 7 uA in deep sleep, all quoted from memory:
assumptions."""
ESP32_C6_AX = EnergyConfig(tx_w=0.8316, rx_w=0.2574, idle_w=0.2574, sleep_w=0.0000231)
"""The same module: 252 mA sending 802.11ax at MCS 9 with 16.5 dBm (Table 5-7), an assumption, too."""
HALOW_20_DBM = EnergyConfig(tx_w=0.66, rx_w=0.132, idle_w=0.132, sleep_w=0.000033)
"""Modules of 802.11ah at 3.3 V: 200 mA sending 20 dBm, 40 mA receiving and listening, 10 uA asleep. These
are assumptions of the right order, not a product's: descriptions of modules with Morse Micro's MM6108 that
could be read give no currents."""
SX1276 = EnergyConfig(tx_w=0.0957, rx_w=0.03795, idle_w=6.6e-7, sleep_w=6.6e-7)
"""Semtech's SX1276 at 3.3 V: 29 mA sending 13 dBm and 11.5 mA receiving (data sheet Rev. 7, Table 6, quoted
from memory: assumptions), .2 µA asleep (200 nA register retention, as a distributor quotes the data sheet).
Between its frames a node of class A sleeps; its empty receive windows are not counted."""
NRF52840 = EnergyConfig(tx_w=0.0192, rx_w=0.01878, idle_w=9.5e-6, sleep_w=9.5e-6)
"""Nordic's nRF52840 at 3 V with DC/DC: 6.40 mA sending 0 dBm and 6.26 mA receiving at 1 Mbit/s (product
specification, current consumption: I_RADIO_TX1, I_RADIO_RX0); 3.16 µA asleep is quoted from memory. Between
its frames a node sleeps."""
MODULE_23_DBM = EnergyConfig(tx_w=0.545, rx_w=0.09, idle_w=0.09, sleep_w=0.000015)
"""A cellular module at 23 dBm, after 3GPP TR 45.820, 5.4, which judged the battery life of NB-IoT: .015 mW
asleep (also quoted so, with about 500 mW sending, by Sauter, "From GSM to LTE-Advanced Pro and 5G",
p. 318); 545 mW sending and 90 mW receiving are quoted from memory: assumptions. It listens for grants
whenever it does not send; LTE-M has the same power class."""

_FAST_CAMERAS = NodesConfig(
    spacing_m=8.0,
    images=0,
    interval_s=10.0,
    image_bytes=69_000,
    depth_bytes=183_000,
    payload_bytes=1500,
    header_bytes=36,
    deadline_s=10.0,
)
"""Cameras with the images and datagrams of the office."""

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
    "wifi-n": NetworkConfig(
        radio=RadioConfig(
            model="log-distance",
            tx_power_dbm=18.5,
            range_m=26.0,  # -64 dBm, which every receiver must reach at MCS 7 (IEEE 802.11-2020, Table 19-23)
            sense_range_m=103.0,  # -82 dBm, at which a preamble must be sensed (19.3.19.5)
        ),
        mac=MacConfig(kind="ieee80211n"),
        nodes=_FAST_CAMERAS,
        uplink=UplinkConfig(rate_bps=100e6),
        energy=ESP32_C6_N,
        run=RunConfig(horizon_s=600.0),
    ),
    "wifi-ax": NetworkConfig(
        radio=RadioConfig(
            model="log-distance",
            tx_power_dbm=16.5,
            range_m=8.88,  # -52 dBm, which every receiver must reach at MCS 11 (802.11ax-2021, Table 27-51)
            sense_range_m=88.7,  # -82 dBm, at which a preamble must be sensed (27.3.20.6)
        ),
        mac=MacConfig(kind="ieee80211ax", mcs=9),
        nodes=_FAST_CAMERAS,
        uplink=UplinkConfig(rate_bps=100e6),
        energy=ESP32_C6_AX,
        run=RunConfig(horizon_s=600.0),
    ),
    "wifi-ah": NetworkConfig(
        radio=RadioConfig(
            model="log-distance",
            frequency_hz=915e6,
            tx_power_dbm=20.0,
            range_m=119.5,  # -74 dBm, which every receiver must reach at MCS 7 in 2 MHz (Table 23-35)
            sense_range_m=475.0,  # -92 dBm, at which a preamble must be sensed (23.3.18.5)
        ),
        mac=MacConfig(kind="ieee80211ah"),
        nodes=_FAST_CAMERAS,
        uplink=UplinkConfig(rate_bps=10e6),
        energy=HALOW_20_DBM,
        run=RunConfig(horizon_s=600.0),
    ),
    "lora": NetworkConfig(
        radio=RadioConfig(
            model="log-distance",
            frequency_hz=868.1e6,
            tx_power_dbm=13.0,
            range_m=3100.0,  # -123 dBm, the SX1276's sensitivity with spreading factor 7
            sense_range_m=3100.0,
        ),
        mac=MacConfig(kind="lora", ack=False),
        nodes=NodesConfig(
            spacing_m=8.0,
            image_bytes=69_000,
            depth_bytes=183_000,
            payload_bytes=222,
            header_bytes=8,
        ),
        uplink=UplinkConfig(rate_bps=10e6),
        energy=SX1276,
        run=RunConfig(horizon_s=172_800.0),
    ),
    "ble": NetworkConfig(
        radio=RadioConfig(
            model="friis",
            tx_power_dbm=0.0,
            range_m=31.0,  # -70 dBm, which every receiver must reach (Bluetooth Core, Vol 6, Part A, 4.1)
            sense_range_m=31.0,
        ),
        mac=MacConfig(kind="ble"),
        nodes=NodesConfig(
            spacing_m=8.0,
            images=0,
            interval_s=10.0,
            image_bytes=69_000,
            depth_bytes=183_000,
            payload_bytes=244,
            header_bytes=8,
            deadline_s=10.0,
        ),
        uplink=UplinkConfig(rate_bps=10e6),
        energy=NRF52840,
        run=RunConfig(horizon_s=600.0),
    ),
    "lte-m": NetworkConfig(
        mac=MacConfig(kind="lte-m"),
        loss=LossConfig(share=0.1),  # the share at which a module reports a rate as usable (36.213, 7.2.3)
        nodes=NodesConfig(
            spacing_m=8.0,
            images=0,
            interval_s=10.0,
            image_bytes=69_000,
            depth_bytes=183_000,
            payload_bytes=120,
            header_bytes=11,  # 8 of the fragment, and 3 of UDP and IP as compressed by RFC 3095
            deadline_s=10.0,
        ),
        energy=MODULE_23_DBM,
        run=RunConfig(horizon_s=600.0),
    ),
    "nb-iot": NetworkConfig(
        mac=MacConfig(kind="nb-iot"),
        loss=LossConfig(share=0.1),
        nodes=NodesConfig(
            spacing_m=8.0,
            images=0,
            interval_s=60.0,
            image_bytes=69_000,
            depth_bytes=183_000,
            payload_bytes=121,
            header_bytes=11,
            deadline_s=60.0,
        ),
        energy=MODULE_23_DBM,
        run=RunConfig(horizon_s=600.0),
    ),
}
"""The scenarios of SPEC 6.1 and 6.2, a lossy multi-hop network, a fast single-hop network, WLAN with
aggregation (IEEE 802.11n, 802.11ax, 802.11ah), and radios in a star, all with the images of the office:
LoRa, which sends one in half a day, Bluetooth LE, LTE-M and NB-IoT."""

"""Names of presets, codings, schemes and causes on the Network screen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from app.drawing.colors import INFERRED, SOURCE, TARGET
from app.web.markup import Markdown
from network_sim.config import STARS, EnergyConfig, NetworkConfig
from network_sim.presets import (
    ESP32_C6_AX,
    ESP32_C6_N,
    HALOW_20_DBM,
    MODULE_23_DBM,
    NRF52840,
    PRESETS,
    SX1276,
    WAVELAN,
)
from network_sim.types import Cause, PacketKind
from packetmesh.errors import InputError
from packetmesh.settings import with_settings


@dataclass(frozen=True, slots=True)
class Preset:
    """A predefined network."""

    title: str
    sentence: str
    """Description."""
    settings: tuple[str, ...] = ()
    """Settings that the screen changes in the preset of the same name, so that a run takes seconds."""
    street: bool = False
    """Whether vehicles send images by schemes; otherwise the scene's cameras send theirs."""


NETWORKS: Mapping[str, Preset] = MappingProxyType(
    {
        "office": Preset(
            "Office: WLAN to one access point",
            "IEEE 802.11b at 11 Mbit/s, the sink 8 m away, an uplink to the cloud; the deadline is 10 "
            "seconds.",
        ),
        "wifi-n": Preset(
            "802.11n: 65 Mbit/s, many packets in a frame",
            "IEEE 802.11n at MCS 7: up to 64 packets in a frame, of which only the lost ones are sent again; "
            "the deadline is 10 seconds.",
        ),
        "wifi-ax": Preset(
            "802.11ax: 115 Mbit/s nearby",
            "IEEE 802.11ax at MCS 9, which reaches 13 m: many packets in a frame; the deadline is 10 "
            "seconds.",
        ),
        "wifi-ah": Preset(
            "802.11ah: WLAN for 100 m",
            "IEEE 802.11ah at 915 MHz, 6.5 Mbit/s: up to 16 packets in a frame; the deadline is 10 seconds.",
        ),
        "thesis-link": Preset(
            "Thesis: 250 kbit/s to one sink",
            "IEEE 802.15.4 at 250 kbit/s, as in the thesis: the images take minutes.",
        ),
        "greenhouse": Preset(
            "Greenhouse: many hops, lossy radio",
            "IEEE 802.15.4 with fading, radios that sleep three quarters of the time; the deadline is "
            "five minutes.",
        ),
        "ble": Preset(
            "Bluetooth LE: cameras in turn",
            "Bluetooth LE at 2 Mbit/s: the sink asks one camera after the other, and none disturbs another; "
            "the deadline is 10 seconds.",
        ),
        "lte-m": Preset(
            "LTE-M: an operator's cell",
            "A half-duplex cellular module in each camera, no sink of your own; one block in ten gets lost; "
            "the deadline is 10 seconds.",
        ),
        "nb-iot": Preset(
            "NB-IoT: a narrow carrier",
            "A cellular module on 180 kHz, at most 62.5 kbit/s for each camera; the deadline is a minute.",
        ),
        "lora": Preset(
            "LoRa: an image in half a day",
            "LoRaWAN at 868 MHz: each camera may send one hundredth of the time, and does not listen before.",
        ),
        "street-grid": Preset(
            "Street grid: vehicles and access points",
            "Vehicles that pass four access points offer them their images; the run is ten minutes after "
            "ten of warm-up.",
            ("run.horizon_s=1200", "run.warmup_s=600", "run.keep=all"),
            street=True,
        ),
    }
)
"""Presets by their names."""

CODINGS: Mapping[str, str] = MappingProxyType(
    {
        "raw": "Raw, depth first",
        "raw-color-first": "Raw, colour first",
        "raw-rows": "Raw, rows spread",
        "raw-tiles": "Raw, 16 × 16 tiles",
        "png": "PNG depth, PNG colour",
        "jpeg": "RVL depth, JPEG colour",
        "rvl": "RVL depth, PNG colour",
        "tiles": "Tiles that stand alone",
        "layered": "Coarse base, then tiles",
        "exact": "Coarse base, then tiles, AVIF colour",
    }
)
"""Titles of ``pipeline.delivery.CODINGS``, whose libraries the server process does not load."""
REQUESTABLE = "exact"
"""The coding of which the sink can request tiles."""

SCHEMES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "BASELINE: everything": ("scheme.name=baseline",),
        "GREEDY: what adds coverage": ("scheme.name=greedy",),
        "GREEDY, at most 5 per request": ("scheme.name=greedy", "scheme.k=5"),
        "WORTH: only pieces that add coverage": ("scheme.name=worth",),
        "PDC: by chance, as offered": ("scheme.name=pdc",),
        "PDC: by chance, as received": ("scheme.name=pdc-received",),
    }
)


def _power(of: EnergyConfig) -> tuple[str, ...]:
    """Return the power of a radio as settings."""
    return tuple(f"energy.{state}_w={getattr(of, f'{state}_w')}" for state in ("tx", "rx", "idle", "sleep"))


CC2420_POWER, WAVELAN_POWER = _power(EnergyConfig()), _power(WAVELAN)
SX1276_POWER, NRF52840_POWER, MODULE_POWER = _power(SX1276), _power(NRF52840), _power(MODULE_23_DBM)
N_POWER, AX_POWER, AH_POWER = _power(ESP32_C6_N), _power(ESP32_C6_AX), _power(HALOW_20_DBM)
ACCESS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "IEEE 802.15.4": ("mac.kind=ieee802154", *CC2420_POWER),
        "IEEE 802.15.4 without ACK": ("mac.kind=ieee802154", "mac.ack=false", *CC2420_POWER),
        "IEEE 802.11b": ("mac.kind=ieee80211b", *WAVELAN_POWER),
        "IEEE 802.11b with RTS/CTS": ("mac.kind=ieee80211b", "mac.rts=true", *WAVELAN_POWER),
        "IEEE 802.11n, MCS 7": ("mac.kind=ieee80211n", "mac.mcs=7", *N_POWER),
        "IEEE 802.11n, MCS 0": ("mac.kind=ieee80211n", "mac.mcs=0", *N_POWER),
        "IEEE 802.11n, one packet in a frame": (
            *("mac.kind=ieee80211n", "mac.mcs=7", "mac.ampdu_packets=1"),
            *N_POWER,
        ),
        "IEEE 802.11ax, MCS 9": ("mac.kind=ieee80211ax", "mac.mcs=9", *AX_POWER),
        "IEEE 802.11ax, MCS 11": ("mac.kind=ieee80211ax", "mac.mcs=11", *AX_POWER),
        "IEEE 802.11ah, 2 MHz, MCS 7": ("mac.kind=ieee80211ah", "mac.mcs=7", *AH_POWER),
        "IEEE 802.11ah, 1 MHz, MCS 7": (
            *("mac.kind=ieee80211ah", "mac.mcs=7", "mac.bandwidth_hz=1000000"),
            *AH_POWER,
        ),
        "a separate link for each node, 250 kbit/s": ("mac.kind=ideal", "mac.link_bps=250000"),
        "a separate link for each node, 1 Mbit/s": ("mac.kind=ideal", "mac.link_bps=1000000"),
        "a separate link for each node, 10 Mbit/s": ("mac.kind=ideal", "mac.link_bps=10000000"),
        "serial line, 57,600 baud": ("mac.kind=serial", "mac.link_bps=57600"),
        "LoRa, spreading factor 7": ("mac.kind=lora", "mac.ack=false", *SX1276_POWER),
        "LoRa, spreading factor 7, with ACK": ("mac.kind=lora", "mac.ack=true", *SX1276_POWER),
        "LoRa, spreading factor 12": (
            *("mac.kind=lora", "mac.ack=false", "mac.spreading_factor=12", "nodes.payload_bytes=51"),
            *SX1276_POWER,
        ),
        "Bluetooth LE 2M": ("mac.kind=ble", *NRF52840_POWER),
        "LTE-M, half-duplex": ("mac.kind=lte-m", *MODULE_POWER),
        "LTE-M, full-duplex": ("mac.kind=lte-m", "mac.full_duplex=true", *MODULE_POWER),
        "NB-IoT, 12 subcarriers": ("mac.kind=nb-iot", *MODULE_POWER),
        "NB-IoT, 1 subcarrier": ("mac.kind=nb-iot", "mac.tones=1", *MODULE_POWER),
    }
)

PACKET_COLORS: Mapping[PacketKind, tuple[int, int, int]] = MappingProxyType(
    {
        PacketKind.IMAGE: TARGET,
        PacketKind.SUMMARY: INFERRED,
        PacketKind.REQUEST: SOURCE,
        PacketKind.STATUS: (120, 80, 30),
    }
)
PACKET_NAMES: Mapping[PacketKind, str] = MappingProxyType(
    {
        PacketKind.IMAGE: "image",
        PacketKind.SUMMARY: "summary",
        PacketKind.REQUEST: "request",
        PacketKind.STATUS: "status",
    }
)
ANSWER = (70, 78, 86)
"""Colour of acknowledgements, darker than nodes and lines."""
CAUSES: Mapping[Cause, str] = MappingProxyType(
    {
        Cause.NONE: "no cause given",
        Cause.COLLISION: "collision",
        Cause.NOISE: "bit errors",
        Cause.RANGE: "out of range",
        Cause.CHANNEL: "channel busy",
        Cause.RETRIES: "too many retries",
        Cause.BUFFER: "buffer full",
        Cause.DEADLINE: "too late",
        Cause.NODE_DOWN: "node down",
        Cause.NO_ROUTE: "no route",
        Cause.UPLINK: "lost on the uplink",
        Cause.ACK_LOST: "acknowledgement lost",
        Cause.LINK: "lost on the link",
    }
)


def ways(preset: str) -> dict[str, tuple[str, ...]]:
    """Return the schemes or access methods that a preset can run with; its own comes first."""
    offered = SCHEMES if NETWORKS[preset].street else ACCESS
    own = PRESETS[preset]
    able = {name: settings for name, settings in offered.items() if _possible(own, settings)}
    first = sorted(able, key=lambda name: with_settings(own, able[name]) != own)
    return {name: able[name] for name in first}


def _possible(config: NetworkConfig, settings: tuple[str, ...]) -> bool:
    """Return whether settings fit the preset; radios of a star are offered only with their own carrier."""
    try:
        changed = with_settings(config, settings)
    except InputError:
        return False
    kinds = {changed.mac.kind, config.mac.kind}
    return len(kinds) == 1 or kinds.isdisjoint(STARS)


TEXT = Markdown(
    """The cameras of the room send their pictures and depth by radio, packet by packet; some are lost.
**Play** below, and watch the mesh grow from what has arrived."""
)
WALK_TEXT = Markdown(
    """One camera walks through the room. It is **one node** with one radio: it sends its keyframes in order,
each from the time at which it was taken. **Play** below, and watch the mesh grow from what has arrived."""
)
STREET_TEXT = Markdown(
    """Vehicles with cameras drive on a grid of streets and offer images to access points (green). **Play**
below: every moving point is a frame on the air; a red point is a frame that was lost there."""
)
ORIGIN = Markdown(
    """The schemes are our reconstruction: of their paper (Bruno & Nurchis, arXiv 1311.6013) only the
abstract and the first lines were available."""
)
RUNNING = Markdown("Sending; the bar at the top shows the progress. *Cancel* stops it.")
PICK = Markdown("Click a frame on the timeline to see its contents and whether it arrived.")

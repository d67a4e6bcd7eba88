"""Names of presets, schemes and curves, and how long the Network screen simulates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from app.drawing.colors import INFERRED, NEUTRAL, SOURCE, TARGET
from app.screens.network.view import Curve
from network_sim.config import PRESETS, NetworkConfig
from network_sim.types import Cause, PacketKind
from packetmesh.errors import InputError
from packetmesh.settings import with_settings


@dataclass(frozen=True, slots=True)
class Preset:
    """A network to begin with."""

    title: str
    sentence: str
    """What it is and for how long it is simulated here."""
    settings: tuple[str, ...]
    """What the screen changes of the preset of the same name, so that a run takes seconds."""
    count_key: str
    count_label: str
    most: int
    schemes: bool = False
    """Whether it compares data-collection schemes; otherwise ways of medium access."""


NETWORKS: Mapping[str, Preset] = MappingProxyType(
    {
        "thesis-link": Preset(
            "Thesis: three nodes, one sink",
            "Each node sends one image of 921,615 bytes to the sink; simulated until all have arrived, at "
            "most ten minutes.",
            ("run.horizon_s=600",),
            "nodes.count",
            "Nodes",
            10,
        ),
        "street-grid": Preset(
            "Street grid: vehicles and access points",
            "Vehicles offer their images to four access points in passing; ten minutes are shown after a "
            "warm-up of ten.",
            ("run.horizon_s=1200", "run.warmup_s=600", "run.keep=all"),
            "street.vehicles",
            "Vehicles",
            120,
            schemes=True,
        ),
        "greenhouse": Preset(
            "Greenhouse: many hops, lossy radio",
            "Nodes in a grid hand small images on to the sink in a corner; half an hour is simulated.",
            ("run.horizon_s=1800",),
            "nodes.count",
            "Nodes",
            24,
        ),
        "office": Preset(
            "Office: one access point, then the cloud",
            "Nodes send colour and depth images every ten seconds; two minutes are simulated.",
            ("run.horizon_s=120",),
            "nodes.count",
            "Nodes",
            12,
        ),
    }
)
"""By the name of the preset."""

SCHEMES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "BASELINE: everything": ("scheme.name=baseline",),
        "GREEDY: what adds coverage": ("scheme.name=greedy",),
        "GREEDY, at most 5 a request": ("scheme.name=greedy", "scheme.k=5"),
        "PDC: by chance, as offered": ("scheme.name=pdc",),
        "PDC: by chance, as received": ("scheme.name=pdc-received",),
    }
)
ACCESS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "IEEE 802.15.4": ("mac.kind=ieee802154",),
        "IEEE 802.15.4 without ACK": ("mac.kind=ieee802154", "mac.ack=false"),
        "IEEE 802.11b": ("mac.kind=ieee80211b",),
        "IEEE 802.11b with RTS/CTS": ("mac.kind=ieee80211b", "mac.rts=true"),
        "a link of its own for each": ("mac.kind=ideal",),
        "serial line, 57,600 baud": ("mac.kind=serial", "mac.link_bps=57600"),
    }
)

CURVES: Mapping[Curve, tuple[str, str, float, str]] = MappingProxyType(
    {
        "delivery": (
            "Delivery",
            "delivered, %",
            100.0,
            "Of the image packets whose way ended in an interval, the share that had arrived.",
        ),
        "delay": (
            "Delay",
            "image delay, s",
            0.0,
            "Mean time from capture to completion of the images that were completed in an interval.",
        ),
        "throughput": (
            "Throughput",
            "kbit/s",
            0.0,
            "Bits of image packets that reached their last node in an interval, over its length.",
        ),
        "energy": (
            "Energy",
            "radio, J",
            0.0,
            "What the radios of all camera nodes have used since the end of the warm-up.",
        ),
    }
)
"""Title, quantity and unit, smallest height of the axis, and meaning of each curve."""

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
ANSWER = NEUTRAL
"""Colour of acknowledgements."""
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
    """Schemes or ways of medium access that a preset can be run with; its own comes first."""
    offered = SCHEMES if NETWORKS[preset].schemes else ACCESS
    own = PRESETS[preset]
    able = {name: settings for name, settings in offered.items() if _possible(own, settings)}
    first = sorted(able, key=lambda name: with_settings(own, able[name]) != own)
    return {name: able[name] for name in first}


def _possible(config: NetworkConfig, settings: tuple[str, ...]) -> bool:
    try:
        with_settings(config, settings)
    except InputError:
        return False
    return True

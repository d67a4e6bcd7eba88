"""Frozen config dataclasses, one for each part of the network, from which all settings are generated."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from network_sim.bounds.image_times import check_image_times
from network_sim.bounds.limits import LARGEST_S, check_limits
from network_sim.bounds.requests import check_requests
from network_sim.settings.mac import OFDM_KINDS, WLAN_KINDS, MacConfig, MacKind
from network_sim.settings.street import SchemeConfig, StreetConfig
from packetmesh.checks import above, at_least, finite, one_each, several, share
from packetmesh.errors import InputError

Propagation = Literal["friis", "two-ray", "log-distance"]
Layout = Literal["star", "line", "grid", "random"]
Keep = Literal["all", "images", "counters"]
Scenario = Literal["collection", "street-grid"]

STARS: tuple[MacKind, ...] = ("lora", "ble", "lte-m", "nb-iot")
"""Medium accesses whose nodes reach only the sink: no node forwards for another one."""
ANY_DISTANCE: tuple[MacKind, ...] = ("serial", "replay", "lte-m", "nb-iot")
"""Medium accesses that connect a node and the sink wherever they are; an operator's cell covers all nodes."""

LEAST_CAPTURE_DB = -5.0
"""Ratio of a frame's power to noise and interference below which ns-3 does not receive it (SPEC 6.3)."""

GUARD_S = 0.05
"""Time before the nodes fall asleep in which no transmission begins."""


@dataclass(frozen=True, slots=True)
class LossConfig:
    """Random losses of data frames on their link, in addition to those on the channel (SPEC 6.5)."""

    share: float = 0.0
    """Share of the data frames that get lost on every link, retransmissions included."""
    burst_packets: float = 1.0
    """Mean length of a run of lost frames (Gilbert-Elliott); 1 makes the losses independent."""

    def __post_init__(self) -> None:
        share("loss.share", self.share)
        at_least("loss.burst_packets", self.burst_packets, 1.0)


@dataclass(frozen=True, slots=True)
class RadioConfig:
    """Propagation and the thresholds of every receiver (SPEC 6.3)."""

    model: Propagation = "two-ray"
    """Mean power over distance: free space (friis), the same with a reflection on the ground (two-ray), or
    a power law (log-distance)."""
    frequency_hz: float = 2.4e9
    """Carrier frequency."""
    tx_power_dbm: float = 15.0
    """Transmitted power."""
    antenna_gain: float = 1.0
    """Gain of each antenna, as a factor."""
    antenna_height_m: float = 1.5
    """Height of each antenna; only two-ray uses it."""
    system_loss: float = 1.0
    """Loss of cables and filters, as a factor."""
    path_loss_exponent: float = 3.0
    """Exponent by which power falls with distance; only log-distance uses it."""
    reference_m: float = 1.0
    """Distance up to which log-distance is free space."""
    shadowing_db: float = 0.0
    """Standard deviation of the gain or loss that each pair of nodes has for the whole run."""
    nakagami_m: float | None = None
    """Shape of the fading drawn for each frame; 1 is Rayleigh, larger fades less, None is no fading."""
    range_m: float = 100.0
    """Nominal range: the receive threshold is the mean power there (IEEE 802.11b: at 11 Mb/s; 802.11n and
    ah: with MCS 7; ax: with MCS 11; LoRa: with spreading factor 7)."""
    sense_range_m: float = 220.0
    """Distance up to which a transmission keeps others silent."""
    capture_db: float | None = None
    """Least ratio of a frame's power to the sum of overlapping ones at which it survives; None is 3 dB in
    IEEE 802.15.4, 6 dB in LoRa, 10 dB in IEEE 802.11b, 1 to 34 dB by the MCS in 802.11n, ax and ah; -5 dB is
    IEEE 802.15.4 as ns-3 simulates it."""
    noise_dbm: float | None = None
    """Power of the noise; None receives everything above the threshold without bit errors."""
    walls_m: tuple[float, ...] = ()
    """x and y of both ends of each wall, four numbers per wall."""
    wall_db: float = 10.0
    """Power lost at each wall that a link crosses."""

    def __post_init__(self) -> None:
        lengths = ("antenna_height_m", "range_m", "reference_m")
        for key in (*lengths, "frequency_hz", "antenna_gain", "path_loss_exponent"):
            above(f"radio.{key}", getattr(self, key), 0.0)
        for key in ("shadowing_db", "wall_db"):
            at_least(f"radio.{key}", getattr(self, key), 0.0)
        at_least("radio.capture_db", self.capture_db, LEAST_CAPTURE_DB)
        at_least("radio.system_loss", self.system_loss, 1.0)
        at_least("radio.nakagami_m", self.nakagami_m, 0.5)
        at_least("radio.sense_range_m", self.sense_range_m, self.range_m)
        several("radio.walls_m", self.walls_m, 4, "wall")
        finite("radio.walls_m", self.walls_m, "metres")


@dataclass(frozen=True, slots=True)
class NodesConfig:
    """Camera nodes that stand still and send their images to one sink (SPEC 6.1)."""

    count: int = 3
    """Camera nodes, without the sink."""
    layout: Layout = "star"
    """Positions of the nodes: around the sink, in a line from it, in a square grid with the sink at a corner,
    or at random in a square with the sink in its middle."""
    spacing_m: float = 20.0
    """Distance to the sink (star) or between neighbours (line, grid; on average: random)."""
    places_m: tuple[float, ...] = ()
    """x and y of every node and, last, of the sink, two numbers per node; empty places them by the layout."""
    images: int = 1
    """Images of each node; 0 takes them until the horizon."""
    interval_s: float = 0.0
    """Time between captures; 0 takes the next image when the last is delivered or given up, or,
    without nodes.retransmit, when all its fragments were sent."""
    image_bytes: int = 921_615
    """Size of a colour image as encoded; a 640 x 480 PPM file by default."""
    depth_bytes: int = 0
    """Size of the depth image that is sent after each colour image, as part of it; 0 sends none."""
    bytes_by_node: tuple[int, ...] = ()
    """Size of each node's own image, depth included; empty gives every node both sizes above."""
    first_bytes_by_node: tuple[int, ...] = ()
    """Bytes of its image that each node sends first. The sink waits for these of all nodes, then requests the
    others. Empty: nodes send their whole images without a request."""
    request_bytes_by_node: tuple[int, ...] = ()
    """Bytes of the sink's request to each node, without its header, if nodes wait for one."""
    image_times_s: tuple[float, ...] = ()
    """Times, from the start of the run, at which the only node takes its images, one for each of
    nodes.images; it sends them in this order. Empty takes them every nodes.interval_s."""
    bytes_by_image: tuple[int, ...] = ()
    """Size of each of these images, depth included."""
    request_after_s: float = 1.0
    """Time that the sink computes before it sends these requests."""
    payload_bytes: int = 116
    """Bytes that a packet hands to the medium access."""
    header_bytes: int = 0
    """Bytes of the payload that are headers of higher layers (fragment, UDP, IP)."""
    buffer_packets: int = 200
    """Packets that wait in a node; a full relay drops arriving packets, a camera fills at most half of the
    buffer and keeps its other fragments outside."""
    retransmit: bool = True
    """Fragments that were given up are sent again until the sink has the image."""
    deadline_s: float | None = None
    """Age at which an image is worthless and given up; None waits until the horizon."""
    duty_cycle: float = 1.0
    """Share of each period in which nodes are awake, all at the same time."""
    duty_period_s: float = 10.0
    """Length of that period."""
    failures_per_h: float = 0.0
    """Mean failures of each node in an hour, at random."""
    recovery_s: float = 60.0
    """Time that a failed node stays down; its buffer is lost."""

    def __post_init__(self) -> None:
        at_least("nodes.count", self.count, 1)
        for key in (
            "images",
            "interval_s",
            "request_after_s",
            "depth_bytes",
            "header_bytes",
            "failures_per_h",
        ):
            at_least(f"nodes.{key}", getattr(self, key), 0)
        for key in ("image_bytes", "payload_bytes", "buffer_packets"):
            at_least(f"nodes.{key}", getattr(self, key), 1)
        for key in ("spacing_m", "deadline_s", "duty_cycle", "duty_period_s", "recovery_s"):
            above(f"nodes.{key}", getattr(self, key), 0.0)
        share("nodes.duty_cycle", self.duty_cycle)
        if self.duty_cycle < 1.0 and self.duty_cycle * self.duty_period_s < GUARD_S:
            period_s = 2.0 * GUARD_S / self.duty_cycle
            longer = f"nodes.duty_period_s={period_s:.3g}"
            raise InputError(
                f"nodes.duty_cycle is {self.duty_cycle} with a nodes.duty_period_s of {self.duty_period_s}, "
                f"which keeps nodes awake for less than {GUARD_S} s, too short to send; try "
                f"{longer if period_s < LARGEST_S else 'a larger nodes.duty_cycle'}"
            )
        nodes = f"nodes.count is {self.count}"
        places = f"x and y of each node and of the sink ({nodes})"
        one_each("nodes.places_m", self.places_m, 2 * (self.count + 1), places)
        for key in ("bytes_by_node", "first_bytes_by_node", "request_bytes_by_node"):
            one_each(f"nodes.{key}", getattr(self, key), self.count, f"one size for each node ({nodes})")
        finite("nodes.places_m", self.places_m, "metres")
        at_least("nodes.bytes_by_node", min(self.bytes_by_node, default=1), 1)
        check_image_times(self.image_times_s, self.bytes_by_image, self.images, self.count)
        sizes = [self.size_bytes(node) for node in range(len(self.first_bytes_by_node))]
        check_requests(self.first_bytes_by_node, self.request_bytes_by_node, sizes, self.images)
        if self.header_bytes >= self.payload_bytes:
            raise InputError(
                f"nodes.header_bytes is {self.header_bytes}, which leaves no room for data in a payload of "
                f"{self.payload_bytes} bytes; try a larger nodes.payload_bytes"
            )

    def size_bytes(self, node: int, number: int = 0) -> int:
        """Return the bytes of a node's image with this number, counted from 0, depth image included."""
        if self.bytes_by_image:
            return self.bytes_by_image[number]
        return self.bytes_by_node[node] if self.bytes_by_node else self.image_bytes + self.depth_bytes


@dataclass(frozen=True, slots=True)
class UplinkConfig:
    """Cellular hop from the sink to the cloud."""

    rate_bps: float | None = None
    """Rate; None means that there is no uplink, and images go no farther than the sink."""
    latency_s: float = 0.05
    """Propagation time of a packet after its last bit was sent."""
    loss: float = 0.0
    """Share of packets that get lost."""
    trace: str | None = None
    """File of a recorded link, as for the nodes; it replaces rate, latency and loss."""

    @property
    def exists(self) -> bool:
        """Whether the sink forwards packets to the cloud."""
        return self.rate_bps is not None or self.trace is not None

    def __post_init__(self) -> None:
        above("uplink.rate_bps", self.rate_bps, 0.0)
        at_least("uplink.latency_s", self.latency_s, 0.0)
        share("uplink.loss", self.loss)


@dataclass(frozen=True, slots=True)
class EnergyConfig:
    """Power of each state: by default a CC2420 radio and a Raspberry Pi 4 (SPEC 6.3)."""

    tx_w: float = 0.0522
    """Radio while it sends."""
    rx_w: float = 0.0564
    """Radio while it receives."""
    idle_w: float = 0.0564
    """Radio while it listens."""
    sleep_w: float = 0.00006
    """Radio while it sleeps."""
    platform_w: float = 2.7
    """Computer and camera of the node while it is awake."""
    platform_sleep_w: float = 0.1
    """Computer and camera of the node while it sleeps."""
    battery_j: float | None = None
    """Energy of a full battery, for the lifetime; None is unlimited."""

    def __post_init__(self) -> None:
        for key in ("tx_w", "rx_w", "idle_w", "sleep_w", "platform_w", "platform_sleep_w"):
            at_least(f"energy.{key}", getattr(self, key), 0.0)
        above("energy.battery_j", self.battery_j, 0.0)


@dataclass(frozen=True, slots=True)
class RunConfig:
    """Duration, seed and recorded events of a run."""

    horizon_s: float = 3600.0
    """Simulated time at which the run stops, if it has not finished before."""
    warmup_s: float = 0.0
    """Time at the start that the metrics leave out."""
    seed: int = 0
    """The same seed gives the same trace."""
    keep: Keep = "all"
    """Keep every event, those of images only, or counters only."""

    def __post_init__(self) -> None:
        above("run.horizon_s", self.horizon_s, 0.0)
        at_least("run.warmup_s", self.warmup_s, 0.0)
        at_least("run.seed", self.seed, 0)
        if self.warmup_s >= self.horizon_s:
            raise InputError(
                f"run.warmup_s is {self.warmup_s}, which leaves nothing of run.horizon_s {self.horizon_s}; "
                "try a shorter warm-up"
            )


@dataclass(frozen=True, slots=True)
class NetworkConfig:
    """All settings of a simulation."""

    scenario: Scenario = "collection"
    """Fixed nodes around one sink (collection), or vehicles on a street grid (street-grid)."""
    radio: RadioConfig = field(default_factory=RadioConfig)
    mac: MacConfig = field(default_factory=MacConfig)
    loss: LossConfig = field(default_factory=LossConfig)
    nodes: NodesConfig = field(default_factory=NodesConfig)
    uplink: UplinkConfig = field(default_factory=UplinkConfig)
    scheme: SchemeConfig = field(default_factory=SchemeConfig)
    street: StreetConfig = field(default_factory=StreetConfig)
    energy: EnergyConfig = field(default_factory=EnergyConfig)
    run: RunConfig = field(default_factory=RunConfig)

    def __post_init__(self) -> None:
        for name in ("radio", "mac", "loss", "nodes", "uplink", "scheme", "street", "energy", "run"):
            check_limits(getattr(self, name), name)
        if self.scenario == "street-grid":
            if self.mac.kind == "replay":
                raise InputError("mac.kind is replay, but vehicles have no link to record; try ieee80211b")
            if self.mac.kind in STARS:
                raise InputError(
                    f"mac.kind is {self.mac.kind}, which joins nodes to one sink, but vehicles pass several "
                    "access points; try ieee80211b"
                )
            if self.mac.kind in OFDM_KINDS:
                raise InputError(
                    f"mac.kind is {self.mac.kind}, which puts several packets into a frame, but vehicles "
                    "send one after the other; try ieee80211b"
                )
            key, data_bytes = "scheme.datagram_bytes", self.scheme.datagram_bytes
            headers_bytes = self.scheme.headers_bytes
        else:
            key, data_bytes, headers_bytes = "nodes.payload_bytes", self.nodes.payload_bytes, 0
        if self.nodes.image_times_s and self.nodes.image_times_s[-1] >= self.run.horizon_s:
            raise InputError(
                f"nodes.image_times_s has an image at {self.nodes.image_times_s[-1]:g} s, but the run stops "
                f"at run.horizon_s={self.run.horizon_s:g}; try a larger run.horizon_s"
            )
        if self.nodes.first_bytes_by_node and not self.mac.reaches_nodes:
            confirmed = self.mac.kind == "lora"
            raise InputError(
                f"mac.kind is {self.mac.kind}{' with mac.ack' if confirmed else ''}, by which the sink sends "
                "nodes no requests here, but nodes.first_bytes_by_node makes them wait for one; try "
                f"{'mac.ack=false' if confirmed else 'mac.kind=ieee802154'}"
            )
        most = self.mac.max_payload_bytes
        capture_db = self.radio.capture_db
        if self.mac.kind in (*WLAN_KINDS, "lora") and capture_db is not None and capture_db < 0.0:
            raise InputError(
                f"radio.capture_db is {capture_db}, with which {self.mac.kind} would receive two frames at "
                "once; try at least 0"
            )
        size_bytes = data_bytes + headers_bytes
        if most is not None and size_bytes > most:
            by = {
                "lora": f" with mac.spreading_factor={self.mac.spreading_factor}",
                "ieee80211ah": f" with mac.mcs={self.mac.mcs} and mac.bandwidth_hz={self.mac.bandwidth_hz:g}",
            }.get(self.mac.kind, "")
            raise InputError(
                f"{key} makes packets of {size_bytes} bytes, but {self.mac.kind} carries {most}{by}; "
                f"try {key}={most - headers_bytes}"
            )

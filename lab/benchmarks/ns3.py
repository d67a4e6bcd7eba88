"""Saturated nodes around one sink in network_sim and in ns-3: throughput and computing time.

ns-3 runs ``ns3_runs.py`` in its own interpreter, IEEE 802.11 twice: with ns-3's defaults, and strict, which
means that a receiver notices every frame.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from network_sim.config import (
    LEAST_CAPTURE_DB,
    WLAN_KINDS,
    MacConfig,
    MacKind,
    NetworkConfig,
    NodesConfig,
    RadioConfig,
)
from network_sim.mac import ieee802154, physical_layer
from network_sim.mac.saturation import saturation
from packetmesh.errors import PacketMeshError

TOLERANCE = 0.05
"""Largest relative difference of throughputs that agree."""
RADIUS_M = 10.0
SEED = 1
ROUNDS = 5
"""Rounds, of which the median time counts; ``ns3_runs.py`` has as many."""
UDP_IP_BYTES = 28
RUNS = Path(__file__).with_name("ns3_runs.py")
IMPORTS_NS3 = "import importlib.util, sys; sys.exit(importlib.util.find_spec('ns') is None)"
PYTHON_VARIABLE = "PACKETMESH_NS3_PYTHON"
"""Variable with the path of an interpreter that has ns-3's bindings."""

Counts = Mapping[MacKind, tuple[int, ...]]
"""Numbers of nodes by medium access."""

NODES: Counts = {
    "ieee802154": (1, 2, 3, 4, 5),
    "ieee80211b": (1, 2, 3, 5, 10, 20, 50),
    "ieee80211n": (1, 3, 10),
    "ieee80211ax": (1, 3, 10),
}
_DATAGRAMS = NodesConfig(payload_bytes=1000 + UDP_IP_BYTES, header_bytes=UDP_IP_BYTES, spacing_m=RADIUS_M)
CONFIGS: dict[MacKind, NetworkConfig] = {
    "ieee802154": NetworkConfig(
        mac=MacConfig(kind="ieee802154"),
        nodes=NodesConfig(payload_bytes=116, spacing_m=RADIUS_M),
        radio=RadioConfig(capture_db=LEAST_CAPTURE_DB),  # overlapping frames as in ns-3 (SPEC 6.3)
    ),
    "ieee80211b": NetworkConfig(mac=MacConfig(kind="ieee80211b"), nodes=_DATAGRAMS),
    "ieee80211n": NetworkConfig(mac=MacConfig(kind="ieee80211n", mcs=7), nodes=_DATAGRAMS),
    "ieee80211ax": NetworkConfig(mac=MacConfig(kind="ieee80211ax", mcs=9), nodes=_DATAGRAMS),
}
DSSS = physical_layer(CONFIGS["ieee80211b"].mac)
CONSTANTS: dict[MacKind, dict[str, float]] = {
    "ieee802154": {
        "backoff": ieee802154.BACKOFF_NS / 1e3,
        "turnaround": ieee802154.TURNAROUND_NS / 1e3,
        "ACK wait": ieee802154.ACK_WAIT_NS / 1e3,
        "LIFS": ieee802154.spacing_ns(127) / 1e3,
        "BE at first": ieee802154.MIN_BE,
        "BE at most": ieee802154.MAX_BE,
        "backoffs again": ieee802154.MAX_CSMA_BACKOFFS,
        "retries": ieee802154.MAX_FRAME_RETRIES,
    },
    "ieee80211b": {
        "slot": DSSS.slot_ns / 1e3,
        "SIFS": DSSS.sifs_ns / 1e3,
        "DIFS": DSSS.difs_ns / 1e3,
        "EIFS": DSSS.eifs_ns / 1e3,
        "data frame": DSSS.data_ns(1000 + UDP_IP_BYTES) / 1e3,
        "ACK": DSSS.ack.duration_ns / 1e3,
        "ACK wait": DSSS.reply_wait_ns / 1e3,
        "CW at first": DSSS.min_window - 1,
        "CW at most": DSSS.max_window - 1,
        "attempts": DSSS.attempts,
    },
}
"""Constants of network_sim, times in microseconds, by the names that ``ns3_runs.py`` uses for ns-3's."""


@dataclass(frozen=True, slots=True)
class Run:
    """Throughput and cost of saturated nodes in one program."""

    throughput_bps: float
    """Payload at the sink."""
    delivery_ratio: float
    """Share of packets that reached the sink before they were given up."""
    attempts: float
    """Frames sent per packet that reached the sink."""
    wall_per_s: float
    """Wall seconds per simulated second."""
    events_per_s: float
    """Events of the program's own kernel per wall second; ns-3 has more of them per frame."""

    @property
    def simulated_s_per_s(self) -> float:
        """Simulated seconds per wall second."""
        return 1.0 / self.wall_per_s


@dataclass(frozen=True, slots=True)
class Row:
    """The same scenario in both programs."""

    mac: MacKind
    nodes: int
    network_sim: Run
    ns3: Run | None
    """None if it did not run; then the ratios are None, too."""
    ns3_strict: Run | None
    """None also for IEEE 802.15.4, which has no strict run."""
    ratio: float | None
    """Throughput of network_sim over ns-3's with its defaults."""
    ratio_strict: float | None
    """Throughput of network_sim over that of the strict ns-3."""

    @property
    def time_ratio(self) -> float | None:
        """Wall time of network_sim over ns-3's with its defaults."""
        return self.network_sim.wall_per_s / self.ns3.wall_per_s if self.ns3 else None

    @property
    def verdict(self) -> str:
        """Agreement of the two programs."""
        if self.ratio is None:
            return "ns-3 did not run"
        if abs(self.ratio - 1.0) <= TOLERANCE:
            return "agrees"
        if self.ratio_strict is not None and abs(self.ratio_strict - 1.0) <= TOLERANCE:
            return "agrees if strict"
        return "differs"


Theirs = dict[tuple[MacKind, int, bool], Run]
"""Runs in ns-3 by medium access, number of nodes and whether it was strict."""


def run_ours(mac: MacKind, nodes: int, seconds: float) -> Run:
    """Return a run in network_sim with the median time of ``ROUNDS``, because single times vary."""
    walls_s = []
    for _ in range(ROUNDS):
        started = time.perf_counter()
        got = saturation(CONFIGS[mac], nodes, seconds, SEED)
        walls_s.append(time.perf_counter() - started)
    wall_s = statistics.median(walls_s)
    arrived = got.delivery_ratio * got.packets
    return Run(
        got.throughput_bps,
        got.delivery_ratio,
        got.attempts / arrived,
        wall_s / seconds,
        got.kernel_events / wall_s,
    )


def run_ns3(python: str, counts: Counts, seconds: float) -> tuple[Theirs, dict[str, dict[str, float]]]:
    """Run all scenarios in ns-3, in its own interpreter ``python``.

    Returns:
        The runs; ns-3's constants like ``CONSTANTS``.

    Raises:
        PacketMeshError: ns-3 failed.
    """
    keys = [
        (mac, nodes, strict)
        for mac, node_counts in counts.items()
        for nodes in node_counts
        for strict in ((False, True) if mac in WLAN_KINDS else (False,))
    ]
    scenarios = [
        {
            "mac": mac,
            "nodes": nodes,
            "payload_bytes": CONFIGS[mac].nodes.payload_bytes,
            "radius_m": RADIUS_M,
            "seconds": seconds,
            "seed": SEED,
            "strict": strict,
        }
        for mac, nodes, strict in keys
    ]
    environment = {**os.environ, "PYTHONSAFEPATH": "1"}  # else ``import ns3`` would find this module
    done = subprocess.run(
        [python, str(RUNS), json.dumps(scenarios)], capture_output=True, text=True, env=environment
    )
    if done.returncode:
        raise PacketMeshError(f"ns-3 failed in {python}: {done.stderr.strip()[-2000:]}")
    got = json.loads(done.stdout.splitlines()[-1])
    runs = zip(keys, got["runs"], strict=True)
    return {key: ns3_run(key[0], one, seconds) for key, one in runs}, got["constants"]


def ns3_run(mac: MacKind, got: dict[str, float], seconds: float) -> Run:
    """Return a run from the counts of ``ns3_runs.py``."""
    nodes = CONFIGS[mac].nodes
    data_bits = 8 * (nodes.payload_bytes - nodes.header_bytes)
    return Run(
        throughput_bps=got["arrived"] * data_bits / got["counted_s"],
        delivery_ratio=got["arrived"] / got["packets"],
        attempts=got["frames"] / got["arrived"],
        wall_per_s=got["wall_s"] / seconds,
        events_per_s=got["events"] / got["wall_s"],
    )


def compare(counts: Counts, theirs: Theirs, seconds: float) -> list[Row]:
    """Run the same scenarios in network_sim, and pair them with ns-3's runs if there are any."""
    rows = []
    for mac, node_counts in counts.items():
        for nodes in node_counts:
            ours = run_ours(mac, nodes, seconds)
            plain, strict = theirs.get((mac, nodes, False)), theirs.get((mac, nodes, True))
            rows.append(Row(mac, nodes, ours, plain, strict, _ratio(ours, plain), _ratio(ours, strict)))
    return rows


def _ratio(ours: Run, theirs: Run | None) -> float | None:
    return ours.throughput_bps / theirs.throughput_bps if theirs else None


def find_python(given: str | None = None) -> str:
    """Return the path of an interpreter with ns-3: ``given``, else ``PYTHON_VARIABLE``'s, else this one.

    Raises:
        PacketMeshError: it cannot import ns-3.
    """
    python = given or os.environ.get(PYTHON_VARIABLE) or sys.executable
    try:
        found = not subprocess.run([python, "-c", IMPORTS_NS3], capture_output=True).returncode
    except OSError:
        found = False
    if not found:
        raise PacketMeshError(
            f"ns-3 was not found: {python} cannot import it; try `python3.11 -m venv ns3env`, "
            f"`ns3env/bin/pip install ns3` and {PYTHON_VARIABLE}=ns3env/bin/python"
        )
    return python

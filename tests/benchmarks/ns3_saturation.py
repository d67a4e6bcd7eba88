"""Saturation throughput of network_sim beside ns-3's, and what a simulated second costs in both.

``python tests/benchmarks/ns3_saturation.py --ns3-python ns3env/bin/python`` runs saturated nodes on a circle
around one sink in both programs: IEEE 802.15.4 with 116-byte payloads, and IEEE 802.11b at 11 Mb/s with 1000
bytes over UDP, acknowledgements at 2 Mb/s, long preambles, no RTS and no fragments. It prints both
throughputs and their ratio, and the reason where they differ by more than 5 %. IEEE 802.11b runs twice in
ns-3: as it comes, and strict, which means that a receiver notices every frame (see ``REASON``).

ns-3 needs an interpreter with ``pip install ns3``: ``--ns3-python``, or PACKETMESH_NS3_PYTHON, or this one.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from unittest.mock import patch

import simpy

from network_sim.config import MacConfig, MacKind, NetworkConfig, NodesConfig
from network_sim.mac import dcf, ieee802154
from network_sim.mac.saturation import saturation

TOLERANCE = 0.05
RADIUS_M = 10.0
SEED = 1
UDP_IP_BYTES = 28
RUNS = Path(__file__).with_name("ns3_runs.py")
IMPORTS_NS3 = "import importlib.util, sys; sys.exit(importlib.util.find_spec('ns') is None)"

NODES: dict[MacKind, tuple[int, ...]] = {"ieee802154": (1, 2, 3, 4, 5), "ieee80211b": (1, 2, 3, 5, 10, 20)}
CONFIGS: dict[MacKind, NetworkConfig] = {
    "ieee802154": NetworkConfig(
        mac=MacConfig(kind="ieee802154"), nodes=NodesConfig(payload_bytes=116, spacing_m=RADIUS_M)
    ),
    "ieee80211b": NetworkConfig(
        mac=MacConfig(kind="ieee80211b"),
        nodes=NodesConfig(payload_bytes=1000 + UDP_IP_BYTES, header_bytes=UDP_IP_BYTES, spacing_m=RADIUS_M),
    ),
}
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
        "slot": dcf.SLOT_NS / 1e3,
        "SIFS": dcf.SIFS_NS / 1e3,
        "DIFS": dcf.DIFS_NS / 1e3,
        "EIFS": dcf.EIFS_NS / 1e3,
        "data frame": dcf.data_ns(1000 + UDP_IP_BYTES) / 1e3,
        "ACK": dcf.ACK_NS / 1e3,
        "ACK wait": dcf.ANSWER_WAIT_NS / 1e3,
        "CW at first": dcf.MIN_WINDOW - 1,
        "CW at most": dcf.MAX_WINDOW - 1,
        "attempts": dcf.ATTEMPTS,
    },
}
"""Of network_sim, times in microseconds, by the names that ``ns3_runs.py`` gives to ns-3's."""
REASON = (
    "ns-3's receivers do not detect the preamble of a frame that collides with an equally strong one, so "
    "bystanders go on after DIFS, where network_sim's wait for EIFS; strict turns ns-3's model of preamble "
    "detection off, and its bystanders wait for EIFS too"
)
"""For IEEE 802.11b."""


@dataclass(frozen=True, slots=True)
class Run:
    """What saturated nodes got in one program, and what it cost."""

    throughput_bps: float
    """Payload at the sink."""
    delivery_ratio: float
    """Share of packets that reached it before they were given up."""
    attempts: float
    """Frames sent for each packet that reached it."""
    wall_per_s: float
    """Wall seconds for a simulated second."""
    events_per_s: float
    """Events of the program's own kernel in a wall second; ns-3 has more of them for a frame."""


@dataclass(frozen=True, slots=True)
class Row:
    """The same scenario in both programs."""

    mac: MacKind
    nodes: int
    network_sim: Run
    ns3: Run
    ns3_strict: Run | None
    ratio: float
    """Throughput of network_sim over ns-3's as it comes."""
    ratio_strict: float | None
    """The same over that of the strict ns-3."""

    @property
    def verdict(self) -> str:
        """How well they agree."""
        if abs(self.ratio - 1.0) <= TOLERANCE:
            return "agrees"
        if self.ratio_strict is not None and abs(self.ratio_strict - 1.0) <= TOLERANCE:
            return "agrees if strict"
        return "differs"


def run_ours(mac: MacKind, nodes: int, seconds: float) -> Run:
    """One run in network_sim."""
    kernels: list[simpy.Environment] = []

    class Watched(simpy.Environment):
        def __init__(self) -> None:
            super().__init__()
            kernels.append(self)

    with patch.object(simpy, "Environment", Watched):
        started = time.perf_counter()
        got = saturation(CONFIGS[mac], nodes, seconds, SEED)
        wall_s = time.perf_counter() - started
    events = next(kernels[0]._eid)  # SimPy numbers the events that it schedules
    arrived = got.delivery_ratio * got.packets
    return Run(
        got.throughput_bps, got.delivery_ratio, got.attempts / arrived, wall_s / seconds, events / wall_s
    )


def run_ns3(
    python: str, seconds: float
) -> tuple[dict[tuple[MacKind, int, bool], Run], dict[str, dict[str, float]]]:
    """All runs in ns-3, in an interpreter of its own.

    Returns:
        Runs by medium access, nodes and whether ns-3 was strict; ns-3's constants like ``CONSTANTS``.
    """
    keys = [
        (mac, nodes, strict)
        for mac, counts in NODES.items()
        for nodes in counts
        for strict in ((False, True) if mac == "ieee80211b" else (False,))
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
    done = subprocess.run([python, str(RUNS), json.dumps(scenarios)], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"ns-3 failed in {python}: {done.stderr.strip()[-2000:]}")
    got = json.loads(done.stdout.splitlines()[-1])
    runs = zip(keys, got["runs"], strict=True)
    return {key: ns3_run(key[0], one, seconds) for key, one in runs}, got["constants"]


def ns3_run(mac: MacKind, got: dict[str, float], seconds: float) -> Run:
    """A run from what ``ns3_runs.py`` counted."""
    nodes = CONFIGS[mac].nodes
    data_bits = 8 * (nodes.payload_bytes - nodes.header_bytes)
    return Run(
        throughput_bps=got["arrived"] * data_bits / got["counted_s"],
        delivery_ratio=got["arrived"] / got["packets"],
        attempts=got["frames"] / got["arrived"],
        wall_per_s=got["wall_s"] / seconds,
        events_per_s=got["events"] / got["wall_s"],
    )


def compare(theirs: dict[tuple[MacKind, int, bool], Run], seconds: float) -> list[Row]:
    """The same scenarios in network_sim, beside ns-3's runs."""
    rows = []
    for mac, counts in NODES.items():
        for nodes in counts:
            ours = run_ours(mac, nodes, seconds)
            plain, strict = theirs[mac, nodes, False], theirs.get((mac, nodes, True))
            ratios = [one and ours.throughput_bps / one.throughput_bps for one in (plain, strict)]
            rows.append(Row(mac, nodes, ours, plain, strict, *ratios))
    return rows


def show_constants(theirs: dict[str, dict[str, float]]) -> None:
    """Print the constants of both."""
    print("Constants of network_sim and, where it has another, of ns-3; times in us")
    for mac, ours in CONSTANTS.items():
        pairs = [
            f"{name} {own:g}" + (f" (ns-3: {theirs[mac][name]:g})" if own != theirs[mac][name] else "")
            for name, own in ours.items()
        ]
        print(f"{mac}: {', '.join(pairs)}")


def beyond(rows: list[Row], mac: MacKind) -> list[int]:
    """With how many nodes the programs do not agree."""
    return [row.nodes for row in rows if row.mac == mac and row.verdict != "agrees"]


def show(rows: list[Row]) -> None:
    """Print two tables, and the reasons of what differs."""
    print("\nThroughput in kb/s, delivery ratio, frames for each packet that arrived; ratios of throughputs")
    print("mac         nodes  network_sim             ns-3                    ratio  strict ns-3  ratio")
    for row in rows:
        both = "  ".join(
            f"{one.throughput_bps / 1e3:8.1f} {one.delivery_ratio:6.2f} {one.attempts:6.2f}"
            for one in (row.network_sim, row.ns3)
        )
        strict = " " * 18
        if row.ns3_strict is not None:
            strict = f"{row.ns3_strict.throughput_bps / 1e3:11.1f}  {row.ratio_strict:5.3f}"
        print(f"{row.mac:<11} {row.nodes:5d}  {both}  {row.ratio:5.3f}  {strict}  {row.verdict}")
    print("\nWall milliseconds for a simulated second, thousand events in a wall second")
    print("mac         nodes  network_sim        ns-3               time ratio")
    for row in rows:
        both = "  ".join(
            f"{1e3 * one.wall_per_s:8.1f} {one.events_per_s / 1e3:8.0f}" for one in (row.network_sim, row.ns3)
        )
        print(
            f"{row.mac:<11} {row.nodes:5d}  {both}  {row.network_sim.wall_per_s / row.ns3.wall_per_s:10.2f}"
        )
    for mac in NODES:
        counts = beyond(rows, mac)
        if counts:
            reason = f": {REASON}" if mac == "ieee80211b" else ""
            print(f"\n{mac} with {', '.join(map(str, counts))} nodes, more than {TOLERANCE:.0%}{reason}.")


def find_python(given: str | None) -> str:
    """An interpreter that has ns-3."""
    python = given or os.environ.get("PACKETMESH_NS3_PYTHON") or sys.executable
    try:
        found = not subprocess.run([python, "-c", IMPORTS_NS3], capture_output=True).returncode
    except OSError:
        found = False
    if not found:
        raise SystemExit(
            f"{python} cannot import ns-3; try `python3.11 -m venv ns3env`, `ns3env/bin/pip install ns3` and "
            "--ns3-python ns3env/bin/python"
        )
    return python


def main() -> None:
    """Compare and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=10.0, help="simulated time of each run (s)")
    parser.add_argument("--ns3-python", help="interpreter that has ns-3's bindings")
    parser.add_argument("--json", action="store_true", help="print JSON")
    options = parser.parse_args()
    if not 1.0 <= options.seconds <= 3600.0:
        parser.error(f"--seconds is {options.seconds}; try 1 to 3600")
    runs, constants = run_ns3(find_python(options.ns3_python), options.seconds)
    rows = compare(runs, options.seconds)
    if options.json:
        found = [{**asdict(row), "verdict": row.verdict} for row in rows]
        reasons = {"ieee80211b": REASON} if beyond(rows, "ieee80211b") else {}
        both = {"network_sim": CONSTANTS, "ns3": constants}
        print(json.dumps({"rows": found, "reasons": reasons, "constants_us": both}, indent=2))
    else:
        show_constants(constants)
        show(rows)


if __name__ == "__main__":
    main()

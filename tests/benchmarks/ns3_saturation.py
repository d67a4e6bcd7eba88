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
from dataclasses import asdict

from lab.benchmarks.ns3 import CONSTANTS, NODES, TOLERANCE, Row, compare, find_python, run_ns3
from network_sim.config import MacKind
from packetmesh.errors import PacketMeshError

REASON = (
    "ns-3's receivers do not detect the preamble of a frame that collides with an equally strong one, so "
    "bystanders go on after DIFS, where network_sim's wait for EIFS; strict turns ns-3's model of preamble "
    "detection off, and its bystanders wait for EIFS too"
)
"""For IEEE 802.11b."""


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
        print(f"{row.mac:<11} {row.nodes:5d}  {both}  {row.time_ratio:10.2f}")
    for mac in NODES:
        counts = beyond(rows, mac)
        if counts:
            reason = f": {REASON}" if mac == "ieee80211b" else ""
            print(f"\n{mac} with {', '.join(map(str, counts))} nodes, more than {TOLERANCE:.0%}{reason}.")


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
    try:
        runs, constants = run_ns3(find_python(options.ns3_python), NODES, options.seconds)
    except PacketMeshError as error:
        raise SystemExit(str(error)) from error
    rows = compare(NODES, runs, options.seconds)
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

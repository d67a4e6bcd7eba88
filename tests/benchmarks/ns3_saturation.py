"""Saturation throughput of network_sim beside ns-3's, and what a simulated second costs in both.

``python tests/benchmarks/ns3_saturation.py --ns3-python ns3env/bin/python`` runs saturated nodes on a circle
around one sink in both programs: IEEE 802.15.4 with 116-byte payloads, and with 1000 bytes over UDP, no
RTS and no fragments IEEE 802.11b at 11 Mb/s (acknowledgements at 2 Mb/s, long preambles), and 802.11n at MCS
7 and 802.11ax at MCS 9 (20 MHz at 2.4 GHz, up to 64 packets in a frame, answers at 24 Mb/s). It prints both
throughputs and their ratio, and the reason where they differ by more than 5 %; the JSON has delivery ratios,
wall times and the constants of both programs as well. IEEE 802.11 runs twice in ns-3: as it comes, and
strict, which means that a receiver notices every frame (see ``REASON``).

ns-3 needs an interpreter with ``pip install ns3``: ``--ns3-python``, or PACKETMESH_NS3_PYTHON, or this one.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict

from lab.benchmarks.ns3 import CONSTANTS, NODES, compare, find_python, run_ns3
from lab.results.tables import ns3_throughput
from network_sim.config import WLAN_KINDS
from packetmesh.errors import PacketMeshError

REASON = (
    "ns-3's receivers do not detect the preamble of a frame that collides with an equally strong one, so "
    "bystanders go on after DIFS, where network_sim's wait for EIFS; strict turns ns-3's model of preamble "
    "detection off, and its bystanders wait for EIFS too"
)
"""For IEEE 802.11."""


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
    differ = dict.fromkeys(row.mac for row in rows if row.mac in WLAN_KINDS and row.verdict != "agrees")
    found = {
        "rows": [{**asdict(row), "verdict": row.verdict} for row in rows],
        "reasons": dict.fromkeys(differ, REASON),
        "constants_us": {"network_sim": CONSTANTS, "ns3": constants},
    }
    print(json.dumps(found, indent=2) if options.json else ns3_throughput(found))


if __name__ == "__main__":
    main()

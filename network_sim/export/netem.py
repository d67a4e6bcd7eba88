"""Shell scripts that give a device of a Linux machine the link of a simulation, by ``tc netem``.

Options and units are those of tc-netem(8), iproute2 6.1. netem sends packets at ``rate``, then delays them.
"""

from __future__ import annotations

from pathlib import Path

from network_sim.config import NetworkConfig
from network_sim.export.link_statistics import LinkStatistics, link_statistics
from network_sim.radio.link_file import read_link_trace
from network_sim.radio.link_trace import LinkTrace
from network_sim.trace.log import NetworkTrace
from packetmesh.errors import InputError
from packetmesh.files import atomic_path

LEAST_BPS = 8.0
"""Least rate that a script sets: netem counts whole bytes per second, and 0 does not limit the rate."""

_STATIC = """#!/bin/sh
# The links of the nodes of a simulated network, for netem, the network emulator of Linux.
# Start as root: sh link.sh DEVICE NODE
# Undo as root:  tc qdisc del dev DEVICE root
# DEVICE is the network device whose outgoing packets get the link; `ip link` lists the devices.
# NODE is one of {nodes}: a node's link leads to the next node of its route.
#
# rate: the bits of the node's packets over the time for which they waited for the channel and were sent.
# delay: mean and standard deviation of how much longer than size / rate a packet took to the next node.
# loss gemodel p r: p of the packets after a delivered one get lost, r of those after a lost one arrive.
# netem counts the device's headers as part of a packet; -14 after the rate leaves out those of Ethernet.
set -eu
if [ $# -ne 2 ]; then
    echo "Start as root: sh $0 DEVICE NODE, with a NODE of {nodes}" >&2
    exit 2
fi
device=$1
case $2 in
{cases}*)
    echo "$2 is not a NODE of {nodes}" >&2
    exit 2
    ;;
esac
tc qdisc replace dev "$device" root netem "$@"
"""
_RECORDED = """#!/bin/sh
# The recorded link {path}, for netem, the network emulator of Linux.
# Start as root: sh link.sh DEVICE
# The script repeats the recording, as the simulation does, until Ctrl-C stops it and undoes its change.
# Undo as root if it was killed: tc qdisc del dev DEVICE root
# DEVICE is the network device whose outgoing packets get the link; `ip link` lists the devices.
#
# The delay is half the round trip. netem has no rate of 0: until the link can send again, the delay is longer
# by the time that is left.
set -eu
if [ $# -ne 1 ]; then
    echo "Start as root: sh $0 DEVICE" >&2
    exit 2
fi
device=$1
now_us() {{
    echo $(($(date +%s%N) / 1000))
}}
# Wait until this many microseconds after the start of the recording, then set the link.
at() {{
    rest_us=$((start_us + $1 - $(now_us)))
    if [ "$rest_us" -gt 0 ]; then
        sleep "$(printf '%d.%06d' $((rest_us / 1000000)) $((rest_us % 1000000)))"
    fi
    shift
    tc qdisc change dev "$device" root netem "$@"
}}
tc qdisc replace dev "$device" root netem {first}
trap 'tc qdisc del dev "$device" root' EXIT
trap 'exit 130' INT TERM
start_us=$(now_us)
while :; do
{rows}    start_us=$((start_us + {span_us}))
done
"""


def check_netem_script(config: NetworkConfig) -> None:
    """Check that a script can be written of a run with this config.

    Raises:
        InputError: the nodes are vehicles, or the log is not kept, from which a link is measured.
    """
    if config.scenario == "street-grid":
        raise InputError(
            "scenario is street-grid, where a vehicle has a link only near access points, so that none can "
            "be emulated; try scenario=collection"
        )
    if config.mac.kind != "replay" and config.run.keep != "all":
        raise InputError(
            f"run.keep is {config.run.keep}, which keeps no packets to measure links on; try run.keep=all"
        )


def write_netem_script(trace: NetworkTrace, path: Path) -> None:
    """Write a script that emulates the recorded link, or the measured link of each node.

    Raises:
        InputError: as for ``check_netem_script``, no node has delivered a packet, or the file cannot be
            written.
    """
    config = trace.config
    check_netem_script(config)
    if config.mac.kind == "replay" and config.mac.trace is not None:
        text = recorded_script(read_link_trace(config.mac.trace), config.mac.trace)
    else:
        text = _measured_script(trace)
    with atomic_path(path) as temporary:
        temporary.write_text(text)


def recorded_script(link: LinkTrace, path: str) -> str:
    """Return a script that changes rate, delay and loss at the times of a recorded link.

    Args:
        link: the recording.
        path: its file, for the comment at the top.
    """
    edges_us = (link.edges_ns // 1000).tolist()
    options = [_recorded_options(link, row) for row in range(len(link.t_s))]
    changed = [row for row, one in enumerate(options) if not row or one != options[row - 1]]
    rows = "".join(f"    at {edges_us[row]} {options[row]}\n" for row in changed)
    name = "".join(letter if letter.isprintable() else "?" for letter in path)
    return _RECORDED.format(path=name, first=options[0], rows=rows, span_us=edges_us[-1])


def netem_options(link: LinkStatistics) -> str:
    """Return the options of netem for a measured link."""
    jitter_us = round(1e6 * link.jitter_s)
    delay = f"delay {round(1e6 * link.delay_s)}us"
    if jitter_us:  # netem refuses a distribution around 0
        delay = f"delay {max(round(1e6 * link.delay_s), 1)}us {jitter_us}us distribution normal"
    loss = f"loss random {_percent(link.loss)}" if link.loss else ""
    if link.bursts is not None:
        loss = f"loss gemodel {_percent(link.bursts.begin)} {_percent(link.bursts.end)} 100% 0%"
    return f"{_rate(link.rate_bps)} {delay} {loss}".strip()


def _measured_script(trace: NetworkTrace) -> str:
    measured = {
        node + 1: link_statistics(trace, node) for node, role in enumerate(trace.roles) if role == "node"
    }
    links = {number: link for number, link in measured.items() if link is not None}
    if not links:
        raise InputError(
            "No node delivered a packet, so that no link can be measured; try a longer run.horizon_s or a "
            "larger radio.range_m"
        )
    cases = "".join(
        f"{number}) # {link.packets} packets, {_percent(link.loss)} lost, {1e3 * link.one_way_s:.3g} ms\n"
        f"    set -- {netem_options(link)}\n    ;;\n"
        for number, link in links.items()
    )
    return _STATIC.format(nodes=", ".join(map(str, links)), cases=cases)


def _recorded_options(link: LinkTrace, row: int) -> str:
    """Return the options of a row; one with a rate of 0 has the next other rate and waits for it."""
    rates_bps, delay_us = link.rate_bps, 0.5e6 * link.round_trip_s[row]
    ahead = [*range(row, len(rates_bps)), *range(row)]
    opens = next(place for place in ahead if rates_bps[place] > 0.0)
    if opens != row:
        starts_us, span_us = link.edges_ns[:-1] / 1000, link.edges_ns[-1] / 1000
        delay_us += (starts_us[opens] - starts_us[row]) % span_us
    loss = f" loss random {_percent(link.loss[row])}" if link.loss[row] else ""
    return f"{_rate(rates_bps[opens])} delay {delay_us:.0f}us{loss}"


def _rate(rate_bps: float) -> str:
    return f"rate {round(max(rate_bps, LEAST_BPS) / 1e3, 3):.12g}kbit"


def _percent(share: float) -> str:
    return f"{100.0 * share:.6g}%"

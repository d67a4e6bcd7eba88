"""Recorded links in the files of other programs: mahimahi traces; for iperf3 see ``link_iperf3``."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from network_sim.radio.link_iperf3 import iperf3_link
from network_sim.radio.link_trace import LinkTrace
from packetmesh.errors import InputError
from packetmesh.files import json_object, read_bytes

OPPORTUNITY_BYTES = 1500
"""Bytes that a line of a mahimahi trace can deliver (mm-link(1), mahimahi 0.98)."""
STEP_MS = 100
"""Approximate step in which a mahimahi trace is read: shorter ones hold too few lines for a rate."""
LONGEST_MS = 24 * 3_600_000
"""Longest mahimahi trace that is read: a day."""
MOST_DIGITS = len(str(LONGEST_MS))
_CAPTURES = tuple(map(bytes.fromhex, ("a1b2c3d4", "d4c3b2a1", "a1b23c4d", "4d3cb2a1", "0a0d0d0a")))
"""First bytes of pcap in both byte orders, with times in us and in ns, and of pcapng."""
_INSTEAD = "try the output of iperf3 --json"


def refuse_capture(path: str | Path, most_bytes: int) -> None:
    """Raise if a file is a packet capture.

    Raises:
        InputError: it is one, or cannot be read.
    """
    if read_bytes(path, most_bytes, "recorded link").startswith(_CAPTURES):
        raise InputError(
            f"The recorded link {path} is a packet capture, which shows what was sent, not what the link "
            f"could carry; {_INSTEAD}"
        )


def other_link(text: str, path: str) -> tuple[LinkTrace, str] | None:
    """Read the file of another program.

    Args:
        text: content of the file.
        path: the file, for messages.

    Returns:
        The link, and a sentence about what the file lacks; None if the file is of no known program.

    Raises:
        InputError: the file is of a known program, but no link can be read from it.
    """
    if text.lstrip().startswith("{"):
        return iperf3_link(json_object(text, path, "recorded link"), path)
    if text.startswith("PING "):
        raise InputError(
            f"The recorded link {path} is ping's output, which has no rate; {_INSTEAD}, or add a column with "
            "the rate"
        )
    lines = text.split()
    if lines and all(line.isascii() and line.isdigit() for line in lines) and _one_column(text):
        return mahimahi_link(lines, path)
    return None


def mahimahi_link(lines: Sequence[str], path: str) -> tuple[LinkTrace, str]:
    """Read a mahimahi trace: rising times in ms at which 1500 bytes can be delivered, repeated for ever.

    A line counts in the step that ends with it, so that the trace repeats after its last line; one at 0 ms
    is at the end of the repetition before. All steps have the same length, and no byte is lost.

    Raises:
        InputError: the times do not rise, or the trace is not 1 ms to a day long.
    """
    times_ms = [int(line) if len(line) <= MOST_DIGITS else LONGEST_MS + 1 for line in lines]
    for number, (before, after) in enumerate(pairwise(times_ms), 2):
        if after < before:
            raise InputError(
                f"{path}, time {number} is {before - after} ms before the one above; try a mahimahi trace "
                "with rising times, or columns of time, rate, round trip and loss"
            )
    last_ms = times_ms[-1]
    if not 0 < last_ms <= LONGEST_MS:
        found = "more than a day" if last_ms else "0 ms"
        raise InputError(
            f"The recorded link {path}, read as a mahimahi trace, lasts {found}; try a trace of 1 ms to a day"
        )
    count = max(1, round(last_ms / STEP_MS))
    places = -(-np.array(times_ms, np.int64) * count // last_ms) - 1
    step_s = 1e-3 * last_ms / count
    starts_s = step_s * np.arange(count, dtype=np.float64)
    lines_in = np.bincount(places % count, minlength=count).astype(np.float64)
    rate_bps = 8.0 * OPPORTUNITY_BYTES / step_s * lines_in
    note = (
        f"The recorded link {path} was read as a mahimahi trace in steps of {step_s:.3g} s; it has no round "
        "trip and no losses, which count as 0 (loss.share adds losses)"
    )
    return LinkTrace(starts_s, rate_bps, np.zeros(count), np.zeros(count)), note


def _one_column(text: str) -> bool:
    return all(len(line.split()) < 2 for line in text.splitlines())

"""Load tests of thirty browsers on one server: waiting times, memory, files and failures."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.compute.pool import PATIENCE_S
from app.load.serving import Look, Serving, serving
from app.load.visitor import Diary, Visitor

SCENE = "living-room"
BROWSERS = 30
LEAVING = 5
"""Number of browsers that leave in the middle."""
STAY_S = 90.0
"""Time that a browser stays in the soak test, seconds."""
LOOK_S = 0.5
LATE_S = 2.0
"""Limit for an answer that needs no computation, seconds."""
PREPARED_S = 900.0
"""Longest wait for the results that the server computes before a class comes, seconds."""
SETTLE_S = 2.0 * PATIENCE_S
"""Wait after the last browser has left, seconds."""


@dataclass(frozen=True, slots=True)
class Load:
    """Records of the browsers and of the server's state."""

    diaries: tuple[Diary, ...]
    looks: tuple[tuple[float, Look], ...]
    """States of the server, each after its time in seconds since the first browser came."""
    before: Look
    """State before the first browser."""
    after: Look
    """State some time after the last browser."""
    prepared_s: float = 0.0
    """Time for which the server was left to compute ahead before the first browser came."""

    def record(self) -> dict[str, Any]:
        """Return the figures; times in seconds."""
        looks = [look for _, look in self.looks]
        end_s = self.looks[-1][0]
        return {
            "browsers": len(self.diaries),
            "prepared_s": self.prepared_s,
            "clicks": sum(len(diary.answers_s) for diary in self.diaries),
            "answers_s": _spread([s for diary in self.diaries for s in diary.answers_s]),
            "late": sum(s > LATE_S for diary in self.diaries for s in diary.answers_s),
            "opened_s": _spread([diary.opened_s for diary in self.diaries]),
            "first_mesh_s": _spread([diary.first_mesh_s for diary in self.diaries]),
            "meshes_s": _spread([s for diary in self.diaries for s in diary.meshes_s]),
            "lost": [diary.lost for diary in self.diaries if diary.lost],
            "notices": sorted({notice for diary in self.diaries for notice in diary.notices}),
            "longest_stray_s": self.longest_stray_s(),
            "strays_beyond_patience": self.strays(PATIENCE_S + 2.0 * LOOK_S),
            "server_peak_bytes": max(look.server_bytes for look in looks),
            "workers_peak_bytes": max(look.workers_bytes for look in looks),
            "quarters": [self._part(end_s * i / 4.0, end_s * (i + 1) / 4.0) for i in range(4)],
            "before": _counts(self.before),
            "after": _counts(self.after),
        }

    def notes(self) -> tuple[str, ...]:
        """Return the figures as lines of text."""
        record = self.record()
        names = {
            "answers_s": "click to answer",
            "first_mesh_s": "first surface",
            "meshes_s": "drag to surface",
        }
        spreads = [(name, record[key]) for key, name in names.items() if record[key]["count"]]
        quarters = [quarter for quarter in record["quarters"] if quarter]
        return (
            f"browsers came after {self.prepared_s:.0f} s of computing ahead",
            *(
                f"{name}: median {one['median']:.2f}, 95 % {one['p95']:.2f}, most {one['max']:.2f} s "
                f"({one['count']})"
                for name, one in spreads
            ),
            f"later than {LATE_S:g} s: {record['late']} of {record['clicks']} answers",
            f"memory: server {record['server_peak_bytes'] / 1e6:.0f} MB, "
            f"workers {record['workers_peak_bytes'] / 1e6:.0f} MB at most; server by quarters "
            + ", ".join(
                f"{quarter['server_least_bytes'] / 1e6:.0f} to {quarter['server_bytes'] / 1e6:.0f}"
                for quarter in quarters
            ),
            "store by quarters: "
            + ", ".join(f"{quarter['files']} files {quarter['bytes'] / 1e6:.0f} MB" for quarter in quarters),
            f"lost: {len(record['lost'])} of {record['browsers']} browsers; jobs of browsers that had left: "
            f"{record['strays_beyond_patience']} beyond {PATIENCE_S + 2.0 * LOOK_S:g} s, the longest "
            f"{record['longest_stray_s']:.1f} s",
        )

    def longest_stray_s(self) -> float:
        """Return the longest time for which a job of a browser that had left was seen running."""
        return max(self._strays_s().values(), default=0.0)

    def strays(self, longer_than_s: float) -> int:
        """Return the number of jobs of browsers that had left that were seen for longer than this."""
        return sum(seconds > longer_than_s for seconds in self._strays_s().values())

    def _strays_s(self) -> dict[int, float]:
        seen: dict[int, list[float]] = {}
        for at_s, look in self.looks:
            for number in look.strays:
                seen.setdefault(number, []).append(at_s)
        return {number: times[-1] - times[0] for number, times in seen.items()}

    def _part(self, begin_s: float, end_s: float) -> dict[str, float]:
        """Return each quantity's largest value in a time span, and also the least of the server's memory,
        because the memory rises and falls with every browser; empty if the span has no state of the server.
        """
        looks = [_counts(look) for at_s, look in self.looks if begin_s <= at_s <= end_s]
        if not looks:
            return {}
        least = min(look["server_bytes"] for look in looks)
        return {name: max(look[name] for look in looks) for name in looks[0]} | {"server_least_bytes": least}


def put_load(seconds: float) -> Load:
    """Keep thirty browsers on a prepared server for this long; five of them leave in the middle."""
    with serving(SCENE) as server:
        prepared_s = _prepare(server)
        before = server.look()
        started_s = time.monotonic()
        visitors = [Visitor(server.url, seed) for seed in range(BROWSERS)]
        looks = list(_looks(server, started_s, seconds / 2.0))
        for visitor in visitors[:LEAVING]:
            visitor.leave()
        looks += _looks(server, started_s, seconds)
        for visitor in visitors[LEAVING:]:
            visitor.leave()
        looks += _looks(server, started_s, seconds + SETTLE_S)
        diaries = tuple(visitor.diary for visitor in visitors)
        return Load(diaries, tuple(looks), before, server.look(), prepared_s)


def _prepare(server: Serving) -> float:
    """Wait until the server has computed ahead, as before a lesson; give up after ``PREPARED_S``.

    Returns:
        The time waited, seconds.
    """
    started_s = time.monotonic()
    while not server.look().prepared and time.monotonic() - started_s < PREPARED_S:
        time.sleep(LOOK_S)
    return time.monotonic() - started_s


def soak(seconds: float) -> Load:
    """Keep thirty browsers on a server for this long; every few seconds one leaves and a new one comes."""
    with serving(SCENE) as server:
        before = server.look()
        started_s = time.monotonic()
        visitors = [Visitor(server.url, seed) for seed in range(BROWSERS)]
        looks: list[tuple[float, Look]] = []
        every_s = STAY_S / BROWSERS
        for number in range(1, int(seconds / every_s) + 1):
            looks += _looks(server, started_s, number * every_s)
            visitors[number - 1].leave()
            visitors.append(Visitor(server.url, BROWSERS + number))
        for visitor in visitors[-BROWSERS:]:
            visitor.leave()
        looks += _looks(server, started_s, time.monotonic() - started_s + SETTLE_S)
        return Load(tuple(visitor.diary for visitor in visitors), tuple(looks), before, server.look())


def _looks(server: Serving, started_s: float, until_s: float) -> Iterator[tuple[float, Look]]:
    """Yield the server's state about every ``LOOK_S``, until this many seconds after the start."""
    while time.monotonic() - started_s < until_s:
        yield time.monotonic() - started_s, server.look()
        time.sleep(LOOK_S)


def _counts(look: Look) -> dict[str, float]:
    return {
        "sessions": look.sessions,
        "threads": look.threads,
        "files": look.files,
        "bytes": look.bytes,
        "server_bytes": look.server_bytes,
        "workers_bytes": look.workers_bytes,
    }


def _spread(seconds: list[float]) -> dict[str, float]:
    """Return count, median, 95th percentile and maximum of the times that are not NaN.

    If there are none, only the count of 0 is returned.
    """
    came = [one for one in seconds if one == one]
    if not came:
        return {"count": 0}
    median, p95 = np.percentile(came, (50.0, 95.0))
    return {"count": len(came), "median": float(median), "p95": float(p95), "max": max(came)}

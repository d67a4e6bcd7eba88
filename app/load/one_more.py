"""What a server has to do for one more browser that sees what others have seen."""

from __future__ import annotations

import contextlib
import time
from dataclasses import dataclass

import numpy as np

from app.load.classroom import PATIENCE_S, RADII_MM, SCENE, ClassPage
from app.load.connection import wait_for
from app.load.serving import Serving, serving

BROWSERS = 8
"""Number of browsers after the first one."""
QUIET_S, QUIET_SHARE = 1.0, 0.03
"""The server is at rest if it uses less than this share of a processor for so long."""


@dataclass(frozen=True, slots=True)
class OneMore:
    """Processor time of the serving process for each further browser, seconds; medians of several."""

    opens_s: float
    """For opening the page."""
    shows_s: float
    """For going to the surface."""
    drags_s: float
    """For one new radius, with everything that follows once the slider rests."""

    def record(self) -> dict[str, float]:
        """Return the figures."""
        return {"opens_s": self.opens_s, "shows_s": self.shows_s, "drags_s": self.drags_s}

    def note(self) -> str:
        """Return the figures as a line of text."""
        return (
            f"the server's work for one more browser that sees the same: {1e3 * self.opens_s:.0f} ms to open "
            f"the page, {1e3 * self.shows_s:.0f} to show the surface, {1e3 * self.drags_s:.0f} for a radius"
        )


def work_for_one_more() -> OneMore:
    """Let browsers come one after the other, each to the same surface and to the same radii."""
    with serving(SCENE) as server, contextlib.ExitStack() as stack:
        rows = [_visit(server, stack, number) for number in range(1 + BROWSERS)]
    return OneMore(*np.median(rows[1:], axis=0).tolist())


def _visit(server: Serving, stack: contextlib.ExitStack, number: int) -> tuple[float, float, float]:
    """Open a page, which stays, go to the surface, and drag its radius. Returns each one's processor time."""
    times_s = [_rested_s(server)]
    page = stack.enter_context(contextlib.closing(ClassPage(server.url, number, by_name=True)))
    wait_for(lambda: bool(page.mark("Surface")), PATIENCE_S)
    times_s.append(_rested_s(server))
    page.go("Surface")
    wait_for(lambda: bool(page.meshes_s()), PATIENCE_S)
    times_s.append(_rested_s(server))
    for radius_mm in RADII_MM:
        dragged_s = time.monotonic()
        page.set("Radius (mm)", radius_mm)
        wait_for(lambda since_s=dragged_s: max(page.meshes_s()) > since_s, PATIENCE_S)  # type: ignore[misc]
        times_s.append(_rested_s(server))
    opens_s, shows_s, *drags_s = np.diff(times_s).tolist()
    return opens_s, shows_s, float(np.mean(drags_s))


def _rested_s(server: Serving) -> float:
    """Wait until the server rests. Returns the processor time that it has used."""
    before_s = server.used_s()
    while True:
        time.sleep(QUIET_S)
        now_s = server.used_s()
        if now_s - before_s < QUIET_SHARE * QUIET_S:
            return now_s
        before_s = now_s

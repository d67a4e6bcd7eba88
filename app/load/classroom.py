"""A class behind one access point: thirty pages that show the same surface and drag it, all at once.

A page fetches contents as ``contents.js`` does: those of what is shown, and on this slow line the coarse copy
of the first surface before the whole. Without its cookie it gets everything in its messages, as viser's own
pages do.
"""

from __future__ import annotations

import contextlib
import http.client
import threading
import time
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from math import nan
from typing import Any
from urllib.parse import urlsplit

import numpy as np
from websockets.exceptions import ConnectionClosed

from app.load.connection import Connection, wait_for
from app.load.line import Line, line
from app.load.serving import serving
from app.web.contents import COARSE, COOKIE, FOLDER

BROWSERS = 30
BITS_PER_S = 20e6
"""Rate of a classroom's access point."""
SCENE = "living-room"
MESHES = "/surface/after/mesh-"
"""Beginning of the names of the surfaces that are shown."""
PATIENCE_S = 300.0
RADII_MM = (38.0, 33.0)
"""Radii to which all drag."""
AT_ONCE = 6
"""Number of contents that a browser fetches at once."""


class ClassPage(Connection):
    """A page that draws nothing but fetches what it would draw; its meshes are timed."""

    def __init__(self, url: str, number: int, by_name: bool) -> None:
        self._address = urlsplit(url)
        self._cookie = f"{COOKIE}={number:022}" if by_name else ""
        self._hidden: set[str] = set()
        self._held: dict[str, list[dict[str, Any]]] = {}
        self._fetching = ThreadPoolExecutor(AT_ONCE)
        self._under_way: list[Future[None]] = []
        self.coarse_s: dict[str, float] = {}
        """``time.monotonic()`` at which each surface or its coarse copy was there, by name."""
        self.whole_s: dict[str, float] = {}
        super().__init__(url, self._cookie)

    def close(self) -> None:
        super().close()
        self._fetching.shutdown(wait=False, cancel_futures=True)

    def meshes_s(self) -> list[float]:
        """Return the times at which surfaces were whole."""
        return _meshes(self.whole_s)

    def page_bytes(self) -> int:
        """Load the page itself. Returns its bytes."""
        return len(self._get("/"))

    def _take_message(self, message: dict[str, Any]) -> None:
        name = str(message.get("name", ""))
        if message["type"] == "SetSceneNodeVisibilityMessage":
            (self._hidden.discard if message["visible"] else self._hidden.add)(name)
            for held in [held for held in self._held if not self._is_hidden(held)]:
                self._draw(held, self._held.pop(held))
        elif message["type"] == "RemoveSceneNodeMessage":
            self._held.pop(name, None)
        elif name.startswith("/") and "props" in message:
            properties = message["props"].values()
            contents = [one for one in properties if isinstance(one, dict) and "packetmesh" in one]
            if self._is_hidden(name):
                self._held[name] = contents
            else:
                self._draw(name, contents)
        super()._take_message(message)

    def _is_hidden(self, name: str) -> bool:
        return any(name == above or name.startswith(f"{above}/") for above in list(self._hidden))

    def _draw(self, name: str, contents: list[dict[str, Any]]) -> None:
        """Fetch a node's contents, the coarse copy of the first surface before the others."""
        first = not any(other.startswith(MESHES) for other in self.whole_s)
        for content in contents:
            path = FOLDER + content["packetmesh"]
            if content["coarse"] and first:
                self._get(f"{path}?{COARSE}")
                self.coarse_s[name] = time.monotonic()
            self._under_way = [one for one in self._under_way if not one.done()]
            self._under_way.append(self._fetching.submit(self._fetch, name, path))
        if not contents:
            self.coarse_s[name] = self.whole_s[name] = time.monotonic()

    def _answer_drawn(self) -> None:
        """Confirm once the contents of all messages so far have arrived, as a page that draws them does."""
        awaited = tuple(self._under_way)

        def answer() -> None:
            wait(awaited)
            with contextlib.suppress(ConnectionClosed):
                super(ClassPage, self)._answer_drawn()

        threading.Thread(target=answer, daemon=True).start()

    def _fetch(self, name: str, path: str) -> None:
        self._get(path)
        self.whole_s[name] = time.monotonic()
        self.coarse_s.setdefault(name, self.whole_s[name])

    def _get(self, path: str) -> bytes:
        host, port = self._address.hostname or "", self._address.port
        with contextlib.closing(http.client.HTTPConnection(host, port, timeout=PATIENCE_S)) as connection:
            connection.request("GET", path, headers={"Cookie": self._cookie, "Accept-Encoding": "gzip"})
            answer = connection.getresponse()
            body = answer.read()
        if answer.status != http.HTTPStatus.OK:
            raise ConnectionError(f"{path} was answered with {answer.status}")
        return body


@dataclass(frozen=True, slots=True)
class ClassTimes:
    """Waiting times and bytes of a class; seconds, from the moment at which all pages make a request."""

    by_name: bool
    """Whether the pages fetched contents by their names, instead of getting them in messages."""
    lost: int
    """Number of pages whose connection the server ended before the first surface was requested."""
    page_bytes: int
    """Bytes of the page itself, which browsers keep."""
    first_bytes: float
    """Bytes of a browser until its first surface was whole, without the page."""
    coarse_s: tuple[float, ...]
    """Time of each page until the coarse copy of the first surface; ``whole_s``: until the whole of it."""
    whole_s: tuple[float, ...]
    drag_bytes: float
    """Bytes of a browser for one new radius, the last surface included."""
    drags_s: tuple[float, ...]
    """Times until the quick surface at a new radius, which is shown while the slider is dragged."""

    def record(self) -> dict[str, Any]:
        """Return the figures."""
        spreads = {"coarse_s": self.coarse_s, "whole_s": self.whole_s, "drags_s": self.drags_s}
        return {
            "by_name": self.by_name,
            "lost": self.lost,
            "page_bytes": self.page_bytes,
            "first_bytes": self.first_bytes,
            "drag_bytes": self.drag_bytes,
            **{
                name: {"median": float(np.median(times_s)), "p95": float(np.percentile(times_s, 95.0))}
                for name, times_s in spreads.items()
            },
        }

    def note(self) -> str:
        """Return the figures as a line of text."""
        figures = self.record()
        parts = [
            f"{what} {figures[key]['median']:.1f} s, 95 % {figures[key]['p95']:.1f}"
            for what, key in (("coarse", "coarse_s"), ("whole", "whole_s"), ("dragged", "drags_s"))
        ]
        return (
            f"{BROWSERS} pages behind {BITS_PER_S / 1e6:.0f} Mbit/s, "
            f"{'contents by name' if self.by_name else 'contents in messages'}, {self.lost} lost: "
            f"first surface {', '.join(parts)}; {self.first_bytes / 1e6:.2f} MB each until it was whole "
            f"(and the page's {self.page_bytes / 1e6:.2f}), {self.drag_bytes / 1e6:.2f} MB a drag"
        )


def time_class(by_name: bool) -> ClassTimes:
    """Let a class look at a surface and drag its radius, all at the same moments."""
    with serving(SCENE) as server, line(server.url, BITS_PER_S) as shared, contextlib.ExitStack() as stack:
        pages = [
            stack.enter_context(contextlib.closing(ClassPage(shared.url, number, by_name)))
            for number in range(BROWSERS)
        ]
        wait_for(lambda: all(page.lost or page.mark("Surface") for page in pages), PATIENCE_S)
        _quiet(shared)
        pages = [page for page in pages if not page.lost]
        if not pages:
            return ClassTimes(by_name, BROWSERS, 0, nan, (nan,), (nan,), nan, (nan,))
        page_bytes, before = pages[0].page_bytes(), shared.bytes_down
        asked_s = time.monotonic()
        for page in pages:
            page.go("Surface")
        wait_for(lambda: all(page.meshes_s() for page in pages), PATIENCE_S)
        coarse_s = tuple(min(_meshes(page.coarse_s)) - asked_s for page in pages)
        whole_s = tuple(min(page.meshes_s()) - asked_s for page in pages)
        first_bytes = (shared.bytes_down - before) / len(pages)
        _quiet(shared)
        before, drags_s = shared.bytes_down, list[float]()
        for radius_mm in RADII_MM:
            drags_s += _drag(pages, radius_mm)
            _quiet(shared)
        drag_bytes = (shared.bytes_down - before) / len(pages) / len(RADII_MM)
        return ClassTimes(
            by_name,
            BROWSERS - len(pages),
            page_bytes,
            first_bytes,
            coarse_s,
            whole_s,
            drag_bytes,
            tuple(drags_s),
        )


def _drag(pages: list[ClassPage], radius_mm: float) -> list[float]:
    """Let all pages set a radius. Returns the time until each has a new surface, seconds."""
    asked_s = time.monotonic()
    for page in pages:
        page.set("Radius (mm)", radius_mm)

    def newest_s(page: ClassPage) -> list[float]:
        return [come_s for come_s in page.meshes_s() if come_s > asked_s]

    wait_for(lambda: all(newest_s(page) for page in pages), PATIENCE_S)
    return [min(newest_s(page)) - asked_s for page in pages]


def _meshes(times_s: dict[str, float]) -> list[float]:
    return [come_s for name, come_s in list(times_s.items()) if name.startswith(MESHES)]


def _quiet(shared: Line, quiet_s: float = 3.0) -> None:
    """Wait until the line has carried almost nothing for some seconds."""
    while True:
        before = shared.bytes_down
        threading.Event().wait(quiet_s)
        if shared.bytes_down - before < 20_000:
            return

"""What a page draws, fetched over HTTP by the name of its content.

Viser sends each mesh, cloud and picture over each browser's websocket, encoded anew for each. Here a message
carries the content's name, and the page fetches the content (``contents.js``): it is packed once for all
browsers, the browser's cache keeps it, and what is hidden is fetched when it is shown.

A name is a digest of the content. A browser gets only contents that were offered to one of its own pages,
which it proves with a cookie of the page. A page without the cookie gets the contents in the messages.
"""

from __future__ import annotations

import asyncio
import gzip
import hashlib
import http
import logging
import re
import secrets
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import viser
from numpy.typing import NDArray
from websockets.datastructures import Headers
from websockets.http11 import Response

from app.web import viser_private as private
from app.web.origin import Answer, answering

Data: TypeAlias = bytes | NDArray[Any]
"""A file, or an array of rows."""
COOKIE = "packetmesh_page"
FOLDER = "/contents/"
"""Path below which the contents are."""
GONE = "This content is no longer there, or belongs to another browser: reload the page.\n"
FEWEST_BYTES = 4_000
"""Size from which a content of something new is fetched rather than sent in its message."""
FEWEST_CHANGED_BYTES = 32_000
"""The same for what changes; steps of animations are smaller, and must not wait for a request each."""
COARSE_BYTES = 300_000
"""Size from which a content may have a coarse copy."""
COARSE = "coarse"
"""Query of a content's coarse copy."""
MOST_BYTES, FETCHED_BYTES = 64 << 20, 8 << 20
"""Limits of a browser's contents, and of those of them that it has fetched: the oldest are forgotten."""
MOST_OF_ALL_BYTES = 512 << 20
"""Limit of all browsers' contents; beyond it, data stay in their messages."""
SLOWEST_S = 60.0
"""Time in which a browser must have received a content."""
REMEMBERED = 64
"""Number of contents whose names are known without computing them again."""
_FORMAT = b"3"
"""Part of each name, to be changed with the packing: browsers keep contents by their names."""
_HELD = re.compile(rf"(?:^|[;,]\s*){COOKIE}=([A-Za-z0-9_-]{{22}})\s*(?:[;,]|$)")
logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Packing:
    """How contents are written for the page."""

    pack: Callable[[Data], bytes]
    """Writes a content as the page's script unpacks it."""
    has_coarse: Callable[[Data], bool]
    """Whether a large content has a coarse copy, which a page on a slow line shows first."""
    coarse: Callable[[Data], Data]
    """Makes the coarse copy."""


class Content:
    """A content that browsers may fetch; it and its coarse copy are packed when the first one does."""

    def __init__(self, data: Data, size: int, has_coarse: bool) -> None:
        self.size, self.has_coarse = size, has_coarse
        self._data = data if isinstance(data, bytes) else data.copy()  # an array may change later
        self._packed: dict[bool, Future[bytes]] = {}

    def packed(self, packer: ThreadPoolExecutor, packing: Packing, coarse: bool) -> Future[bytes]:
        """Return a future of the compressed content or of its coarse copy; one that failed is made again."""

        def made() -> bytes:
            content = packing.coarse(self._data) if coarse else self._data
            return gzip.compress(packing.pack(content), 6, mtime=0)

        known = self._packed.get(coarse)
        if known is None or (known.done() and (known.cancelled() or known.exception() is not None)):
            self._packed[coarse] = known = packer.submit(made)
        return known


class Contents:
    """The contents that a server offers to its browsers; used on the thread of the connections only."""

    def __init__(self, packing: Packing) -> None:
        self._packing = packing
        self._packer = ThreadPoolExecutor(1, thread_name_prefix="contents")
        self._known: dict[str, Content] = {}
        self._offered: dict[str, OrderedDict[str, bool]] = {}
        """For each browser, by the number in its cookie, the names of its contents, the oldest first, and
        whether it has fetched each."""
        self._pages: dict[int, str] = {}
        """Number in the cookie of each page, by the number of its connection."""
        self._names: OrderedDict[int, tuple[bytes, str]] = OrderedDict()

    def close(self) -> None:
        """Stop packing."""
        self._packer.shutdown(wait=False, cancel_futures=True)

    def opened(self, page: int, cookies: str) -> None:
        """Note a page that has opened its websocket with these cookies."""
        browser = _browser_in(cookies)
        if browser is not None:
            self._pages[page] = browser
            self._offered.setdefault(browser, OrderedDict())

    def closed(self, page: int) -> None:
        """Forget a page, and with a browser's last page its contents."""
        browser = self._pages.pop(page, None)
        if browser is not None and browser not in self._pages.values():
            for name in self._offered.pop(browser):
                self._forget(name)

    def offer(self, page: int, data: Data, of_new: bool = True) -> dict[str, object] | None:
        """Return what a message to this page has in place of the data; None if it has the data itself.

        ``of_new`` is whether the message adds something, rather than changes it.
        """
        size = len(data) if isinstance(data, bytes) else data.nbytes
        browser = self._pages.get(page)
        if browser is None or size < (FEWEST_BYTES if of_new else FEWEST_CHANGED_BYTES):
            return None
        name = self._name_of(data)
        if name not in self._known:
            if sum(one.size for one in self._known.values()) + size > MOST_OF_ALL_BYTES:
                return None
            has_coarse = size >= COARSE_BYTES and self._packing.has_coarse(data)
            self._known[name] = Content(data, size, has_coarse)
        offered = self._offered[browser]
        offered[name] = False
        offered.move_to_end(name)
        self._limit(offered)
        kind = "" if isinstance(data, bytes) else data.dtype.str
        return {"packetmesh": name, "dtype": kind, "coarse": self._known[name].has_coarse}

    def served(self) -> AbstractContextManager[None]:
        """Return a context. A server started in it sends the contents, and waits longer for slow browsers."""
        return answering(self._answering, open_timeout=SLOWEST_S, close_timeout=SLOWEST_S)

    def _name_of(self, data: Data) -> str:
        known = self._names.get(id(data))
        if known is not None and known[0] is data:
            return known[1]
        kind = b"" if isinstance(data, bytes) else repr((data.dtype.str, data.shape)).encode()
        digest = hashlib.blake2b(b"%s %d %s" % (_FORMAT, len(kind), kind), digest_size=16)
        digest.update(data if isinstance(data, bytes) else np.ascontiguousarray(data).data.cast("B"))
        name = digest.hexdigest()
        if isinstance(data, bytes):  # bytes cannot be changed
            self._names[id(data)] = data, name
            while len(self._names) > REMEMBERED:
                self._names.popitem(last=False)
        return name

    def _limit(self, offered: OrderedDict[str, bool]) -> None:
        """Forget a browser's oldest contents beyond the limits, first those that it has fetched."""
        total = sum(self._known[name].size for name in offered)
        fetched = sum(self._known[name].size for name, is_fetched in offered.items() if is_fetched)
        newest = next(reversed(offered))
        for name in sorted(offered, key=lambda name: not offered[name]):  # stable: the oldest stay first
            if name == newest or (total <= MOST_BYTES and (fetched <= FETCHED_BYTES or not offered[name])):
                continue
            total -= self._known[name].size
            fetched -= self._known[name].size if offered.pop(name) else 0
            self._forget(name)

    def _forget(self, name: str) -> None:
        """Forget a content that no browser may fetch any more."""
        if any(name in offered for offered in self._offered.values()):
            return
        self._known.pop(name, None)
        for key in [key for key, (_, known) in self._names.items() if known == name]:
            del self._names[key]

    def _answering(self, answer: Answer) -> Answer:
        def answered(connection: Any, request: Any) -> Any:
            path, _, query = request.path.partition("?")
            if not path.startswith(FOLDER) or "Upgrade" in request.headers:
                return answer(connection, request)
            name = path.removeprefix(FOLDER)
            offered = self._offered.get(_browser_in(request.headers.get("Cookie", "")) or "")
            if offered is None or name not in offered:
                return connection.respond(http.HTTPStatus.NOT_FOUND, GONE)
            content, coarse = self._known[name], query == COARSE
            if coarse and not content.has_coarse:
                return connection.respond(http.HTTPStatus.NOT_FOUND, GONE)
            offered[name] |= not coarse
            return self._send(content, coarse)

        return answered

    async def _send(self, content: Content, coarse: bool) -> Response:
        packed = asyncio.wrap_future(content.packed(self._packer, self._packing, coarse))
        try:
            body = await asyncio.shield(packed)  # if this browser goes, others still wait for it
        except Exception:
            logger.exception("a content could not be packed")
            raise
        headers = Headers()
        headers["Content-Type"] = "application/octet-stream"
        headers["Content-Encoding"] = "gzip"
        headers["Content-Length"] = str(len(body))
        headers["Cache-Control"] = "private, max-age=31536000, immutable"
        return Response(http.HTTPStatus.OK, "OK", headers, body)


def offer_contents(server: viser.ViserServer, contents: Contents) -> None:
    """Send each page names in place of large contents, from its first message on."""
    private.on_opened(server, lambda page: contents.opened(page, private.cookies(server, page)))
    private.on_closed(server, contents.closed)
    private.replace_data(server, contents.offer)


def page_cookie(cookies: str) -> str:
    """Return the ``Set-Cookie`` header for a page that is requested with these cookies; empty if it has one.

    Browsers share cookies between the ports of a machine, so that all servers take the same one.
    """
    if _browser_in(cookies) is not None:
        return ""
    return f"{COOKIE}={secrets.token_urlsafe(16)}; Path=/; HttpOnly; SameSite=Lax"


def _browser_in(cookies: str) -> str | None:
    """Return the browser's number in a ``Cookie`` header; None without a proper one."""
    held = _HELD.search(cookies)
    return None if held is None else held[1]

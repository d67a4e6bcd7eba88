"""The page as the server sends it: viser's, with the app's title, scripts and styles.

All scripts are files of this server or have their hash in the content policy (``headers.py``): viser's page
is one script that unpacks another. File names hold a hash of the content, so that browsers can keep the
files.
"""

from __future__ import annotations

import gzip
import hashlib
import http
import re
from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import plotly
import viser
import zstandard
from websockets.datastructures import Headers
from websockets.http11 import Response

from app.web.contents import page_cookie
from app.web.markup import Markup, plain_text
from app.web.origin import Answer, answering
from packetmesh.errors import InputError

TITLE = "PacketMesh"
_DIGITS = b"!#$%()*+,-./0123456789:;=?@ABCDEFGHIJKLMNOPQRSTUVWXYZ[\\]^_abcdefghijklmnopqrstuvwxyz{|}~"
"""The digits of the base 88 in which viser's page stores its script."""
_PACKED = re.compile(r'<script data-p="([^"]*)" data-ss="(\d+)" data-cs="(\d+)">(.*?)</script>', re.DOTALL)
_AT_ONCE, _IN_TURN = 'if(document.readyState==="loading")', "if(!window.packetmesh)"
"""Condition under which viser's script waits before it runs the unpacked one, and its replacement."""


@dataclass(frozen=True)
class File:
    """The content that the server sends for one path."""

    path: str
    kind: str
    """MIME type."""
    content: bytes
    kept: bool = True
    """Whether the content never changes, so that a browser need not ask again."""

    @cached_property
    def packed(self) -> bytes:
        """The content, compressed with gzip."""
        return gzip.compress(self.content)

    @cached_property
    def mark(self) -> str:
        """The content's entity tag; a weak one, because the compressed content and the plain one share it."""
        return f'W/"{hashlib.sha256(self.content).hexdigest()[:24]}"'

    def response(self, request: Mapping[str, str]) -> Response:
        """Return the response to a request with these headers; without the content if the browser has it."""
        headers = Headers()
        headers["ETag"] = self.mark
        headers["Vary"] = "Accept-Encoding"
        headers["Cache-Control"] = "public, max-age=31536000, immutable" if self.kept else "private, no-cache"
        cookie = "" if self.kept else page_cookie(request.get("Cookie", ""))
        if cookie:
            headers["Set-Cookie"] = cookie
        if request.get("If-None-Match", "") == self.mark:
            return Response(http.HTTPStatus.NOT_MODIFIED, "Not Modified", headers, b"")
        packed = "gzip" in request.get("Accept-Encoding", "")
        body = self.packed if packed else self.content
        headers["Content-Type"] = self.kind
        headers["Content-Length"] = str(len(body))
        headers["Content-Encoding"] = "gzip" if packed else "identity"
        return Response(http.HTTPStatus.OK, "OK", headers, body)


class Page:
    """Viser's page with the app's additions, read once."""

    def __init__(
        self, scripts: Sequence[Path], styles: Sequence[Path], greetings: Mapping[str, Markup]
    ) -> None:
        """Read viser's page and the app's files.

        Args:
            scripts: the app's scripts, in the order in which they run.
            styles: the app's style sheets.
            greetings: HTML shown over the page, by the path and query that show it.

        Raises:
            InputError: the installed viser has an unknown page.
        """
        self._viser = _viser_page()
        self.script_hashes = tuple(map(_hash, _viser_scripts(self._viser)))
        """Hashes of viser's two scripts, the one in the page and the one that it unpacks, for the policy."""
        plots = Path(plotly.__file__).parent / "package_data" / "plotly.min.js"
        script, plotted = _file("packetmesh", "js", scripts), _file("plotly", "js", [plots])
        style = _file("packetmesh", "css", styles)
        head = Markup(
            '<link rel="stylesheet" href="{}"><script defer src="{}"></script>'
            '<meta name="packetmesh-plotly" content="{}">'
        ).format(*map(_relative, (style, script, plotted)))
        usual = self._page(head, Markup(""))
        self._files = {one.path: one for one in (script, plotted, style)} | {"/": usual, "/index.html": usual}
        self._greetings = {place: self._page(head, greeting) for place, greeting in greetings.items()}

    def served(self) -> AbstractContextManager[None]:
        """Return a context. A server started in it sends this page and its files."""
        return answering(self._answering)

    def _page(self, head: Markup, greeting: Markup) -> File:
        text = self._viser.replace("<title>Viser</title>", f"<title>{TITLE}</title>", 1)
        text = text.replace("</head>", plain_text(head) + "</head>", 1)
        before, end, after = text.rpartition("</body>")
        text = f"{before}{plain_text(greeting)}{end}{after}"
        return File("/", "text/html; charset=utf-8", text.encode(), kept=False)

    def _answering(self, answer: Answer) -> Answer:
        def answered(connection: Any, request: Any) -> Any:
            path = request.path
            found = self._greetings.get(path) or self._files.get(path.partition("?")[0])
            if found is None or "Upgrade" in request.headers:
                return answer(connection, request)
            return found.response(request.headers)

        return answered


def _relative(one: File) -> str:
    """Return a file's address for the page, which a proxy may show under a path of its own."""
    return one.path.removeprefix("/")


def _file(name: str, suffix: str, parts: Sequence[Path]) -> File:
    content = b"\n".join(part.read_bytes() for part in parts)
    mark = hashlib.sha256(content).hexdigest()[:12]
    kinds = {"js": "text/javascript; charset=utf-8", "css": "text/css; charset=utf-8"}
    return File(f"/{name}-{mark}.{suffix}", kinds[suffix], content)


def _viser_page() -> str:
    """Return viser's page, changed to start after the app's scripts, which prepare things for it.

    Raises:
        InputError: the page is not a known one.
    """
    path = Path(viser.__file__).parent / "client" / "build" / "index.html"
    page = path.read_text(encoding="utf-8")
    once = (_AT_ONCE, "<script", "<title>Viser</title>", "</head>")
    if any(page.count(part) != 1 for part in once) or _PACKED.search(page) is None:
        raise _unknown()
    return page.replace(_AT_ONCE, _IN_TURN)


def _unknown() -> InputError:
    version = viser.__version__
    return InputError(f"The page of viser {version} is not known to PacketMesh; try to install viser 1.1.1")


def _viser_scripts(page: str) -> Iterator[str]:
    """Yield the script in viser's page, and the one that it unpacks and runs.

    Raises:
        InputError: the page is packed in an unknown way.
    """
    found = _PACKED.search(page)
    assert found is not None
    packed, style_bytes, code_bytes, script = found.groups()
    try:
        unpacked = zstandard.ZstdDecompressor().decompress(_from_base88(packed))
    except (ValueError, OverflowError, zstandard.ZstdError):  # packed in an unknown way
        raise _unknown() from None
    yield script
    yield unpacked[int(style_bytes) :][: int(code_bytes)].decode()


def _from_base88(text: str) -> bytes:
    """Decode base 88: five digits are four bytes; the last group has one digit more than bytes."""
    places = np.full(128, -1, dtype=np.int64)
    places[np.frombuffer(_DIGITS, dtype=np.uint8)] = np.arange(88)
    digits = places[np.frombuffer(text.encode("ascii"), dtype=np.uint8)]
    rest = len(digits) % 5
    whole = digits[: len(digits) - rest].reshape(-1, 5) @ 88 ** np.arange(4, -1, -1)
    value = 0
    for digit in digits[len(digits) - rest :]:
        value = 88 * value + int(digit)
    return whole.astype(">u4").tobytes() + (value.to_bytes(rest - 1, "big") if rest else b"")


def _hash(script: str) -> str:
    return f"'sha256-{b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"

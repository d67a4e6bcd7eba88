"""What browsers are told to forbid the page: scripts that are not the server's own, code from text, sending
anything anywhere else, being framed.

Scripts are files of this server, or the two of viser's page by their hashes: a script that gets into the
page by a text, an attribute or an address does not run. Viser's page compiles WebAssembly, works in blobs
and sets styles as it runs; so styles within the page are allowed. A text that got past the escaping could
change how the page looks, and call what ``page.js`` offers the server by name; no script of its own runs, and
the page fetches nothing from another place and sends nothing there. What no policy forbids is to leave: by a
link, or a ``<meta http-equiv=refresh>``, which needs no click.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from functools import partial
from typing import Any

from app.web.origin import Answer, answering

POLICY = (
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval' {hashes}; worker-src 'self' blob:; "
    "connect-src 'self' {websocket} data: blob:; img-src 'self' data: blob:; media-src 'self' data: blob:; "
    "style-src 'self' 'unsafe-inline'; font-src 'self' data:; object-src 'none'; frame-src 'none'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""Content-Security-Policy; some browsers do not count a websocket as ``'self'``, so it is named."""
OTHERS = {"X-Content-Type-Options": "nosniff", "X-Frame-Options": "DENY", "Referrer-Policy": "no-referrer"}


def strict_headers(hashes: Sequence[str] = ()) -> AbstractContextManager[None]:
    """Servers that start meanwhile send the policy with every answer.

    Args:
        hashes: of the scripts that may stand in the page, as the policy writes them.
    """
    return answering(partial(_with_headers, " ".join(hashes)))


def _with_headers(hashes: str, answer: Answer) -> Answer:
    def answered(connection: Any, request: Any) -> Any:
        response = answer(connection, request)
        if response is not None:
            host = request.headers.get("Host", "")
            plain = bool(host) and all(letter.isalnum() or letter in ".-:[]_" for letter in host)
            websocket = f"ws://{host} wss://{host}" if plain else ""
            response.headers["Content-Security-Policy"] = POLICY.format(hashes=hashes, websocket=websocket)
            for name, value in OTHERS.items():
                response.headers[name] = value
        return response

    return answered

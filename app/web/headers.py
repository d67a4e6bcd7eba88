"""The content security policy: the page may run only the server's scripts, send nothing elsewhere, and be in
no frame.

Scripts are files of this server, or viser's two page scripts by their hashes: a script that enters the page
through a text, an attribute or an address does not run. Viser's page compiles WebAssembly, uses blobs and
sets styles at run time, so inline styles are allowed. Injected text that got past the escaping could change
the page's look and call the functions that ``page.js`` offers the server; it could run no script, and fetch
nothing from and send nothing to another server. A policy cannot forbid leaving the page through a link or a
``<meta http-equiv=refresh>``, which needs no click.
"""

from __future__ import annotations

from collections.abc import Awaitable, Collection, Sequence
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
"""Content-Security-Policy; the websocket is named because some browsers do not count it as ``'self'``."""
OTHERS = {"X-Content-Type-Options": "nosniff", "X-Frame-Options": "DENY", "Referrer-Policy": "no-referrer"}


def strict_headers(hashes: Sequence[str] = (), allowed: Collection[str] = ()) -> AbstractContextManager[None]:
    """Return a context. A server started in it sends the policy with every answer.

    Args:
        hashes: hashes of the scripts allowed in the page, as the policy writes them.
        allowed: further names of this server, from ``allowed_names``; its websocket may have any port there.
    """
    named = [f"[{name}]" if ":" in name else name for name in sorted(allowed)]
    others = "".join(f" ws://{name}:* wss://{name}:*" for name in named)
    return answering(partial(_with_headers, " ".join(hashes), others))


def _with_headers(hashes: str, others: str, answer: Answer) -> Answer:
    async def later(awaited: Awaitable[Any], request: Any) -> Any:
        return with_policy(await awaited, request)

    def answered(connection: Any, request: Any) -> Any:
        response = answer(connection, request)
        return later(response, request) if isinstance(response, Awaitable) else with_policy(response, request)

    def with_policy(response: Any, request: Any) -> Any:
        if response is not None:
            host = request.headers.get("Host", "")
            plain = bool(host) and all(letter.isalnum() or letter in ".-:[]_" for letter in host)
            websocket = (f"ws://{host} wss://{host}" if plain else "") + others
            response.headers["Content-Security-Policy"] = POLICY.format(hashes=hashes, websocket=websocket)
            for name, value in OTHERS.items():
                response.headers[name] = value
        return response

    return answered

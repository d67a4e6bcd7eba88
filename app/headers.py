"""What browsers are told to forbid the page: other sites' code, sending anything there, being framed by them.

Viser's page unpacks itself by a script within it, draws by workers and WebAssembly from blobs, and runs the
code of plots; so scripts within the page are allowed, and nothing from anywhere else.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any

from app.origin import Answer, answering

POLICY = (
    "default-src 'none'; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:; worker-src 'self' blob:; "
    "connect-src 'self' {websocket} data: blob:; img-src 'self' data: blob:; media-src 'self' data: blob:; "
    "style-src 'self' 'unsafe-inline'; font-src 'self' data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
"""Content-Security-Policy; some browsers do not count a websocket as ``'self'``, so it is named."""
OTHERS = {"X-Content-Type-Options": "nosniff", "X-Frame-Options": "DENY", "Referrer-Policy": "no-referrer"}


def strict_headers() -> AbstractContextManager[None]:
    """Servers that start meanwhile send the policy with every answer."""
    return answering(_with_headers)


def _with_headers(answer: Answer) -> Answer:
    def answered(connection: Any, request: Any) -> Any:
        response = answer(connection, request)
        if response is not None:
            host = request.headers.get("Host", "")
            plain = bool(host) and all(letter.isalnum() or letter in ".-:[]_" for letter in host)
            websocket = f"ws://{host} wss://{host}" if plain else ""
            response.headers["Content-Security-Policy"] = POLICY.format(websocket=websocket)
            for name, value in OTHERS.items():
                response.headers[name] = value
        return response

    return answered

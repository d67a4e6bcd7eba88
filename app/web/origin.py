"""Access to the server for its own page only.

A web page of any other site can open a websocket to 127.0.0.1, and a site whose name is made to point there
(DNS rebinding) can even read the answers. Browsers send the site as ``Origin`` and the name that they looked
up as ``Host``: the two must be equal, and must name this machine.
"""

from __future__ import annotations

import contextlib
import functools
import http
import ipaddress
import socket
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from typing import Any, TypeAlias
from urllib.parse import urlsplit

from websockets.asyncio import server as websockets_server

Answer: TypeAlias = Callable[[Any, Any], Any]
"""Takes a connection and its request. Returns a response, or None to continue to the websocket."""
ONCE = ("Host", "Origin", "Upgrade", "Cookie", "Accept-Encoding")
"""Headers that a request may have only once."""
NOT_WELL_FORMED = "This is not a request that PacketMesh understands.\n"
REFUSED = "PacketMesh answers only its own page: open the address that it printed when it started.\n"


def is_own(headers: Mapping[str, str]) -> bool:
    """Whether a request comes from this server's own page, or from no page.

    Args:
        headers: headers of the request; names in any case.
    """
    host = headers.get("Host", "")
    origin = headers.get("Origin")
    try:
        name = urlsplit(f"//{host}").hostname or ""
        page = host if origin is None else urlsplit(origin).netloc
    except ValueError:  # an address with an unclosed bracket
        return False
    return _names_this_machine(name) and page.lower() == host.lower()


def _names_this_machine(name: str) -> bool:
    """Whether a host name is certainly ours: an IP address, localhost, or the name of this machine."""
    with contextlib.suppress(ValueError):
        ipaddress.ip_address(name)
        return True
    own = {"localhost", socket.gethostname().lower(), socket.getfqdn().lower()}
    return name.lower() in own | {f"{socket.gethostname().lower()}.local"}


def well_formed() -> AbstractContextManager[None]:
    """Context in which servers start that answer 400 to unreadable requests, where viser fails with 500."""
    return answering(_understood)


def _understood(answer: Answer) -> Answer:
    def answered(connection: Any, request: Any) -> Any:
        try:
            if any(len(request.headers.get_all(name)) > 1 for name in ONCE):
                raise ValueError("twice")
            return answer(connection, request)
        except (ValueError, LookupError):
            return connection.respond(http.HTTPStatus.BAD_REQUEST, NOT_WELL_FORMED)

    return answered


def only_own_page() -> AbstractContextManager[None]:
    """Context in which servers start that refuse requests from other sites' pages."""
    return answering(_guard)


@contextlib.contextmanager
def answering(change: Callable[[Answer], Answer]) -> Iterator[None]:
    """Context in which servers start whose answers to requests are changed by ``change``.

    Viser has no option for this.
    """
    serve = websockets_server.serve

    @functools.wraps(serve)
    def changed(*arguments: Any, process_request: Answer, **options: Any) -> Any:
        return serve(*arguments, process_request=change(process_request), **options)

    setattr(websockets_server, "serve", changed)  # noqa: B010
    try:
        yield
    finally:
        setattr(websockets_server, "serve", serve)  # noqa: B010


def _guard(answer: Answer) -> Answer:
    """Return the server's answer function, which now refuses requests from other sites."""

    def guarded(connection: Any, request: Any) -> Any:
        if not is_own(request.headers):
            return connection.respond(http.HTTPStatus.FORBIDDEN, REFUSED)
        return answer(connection, request)

    return guarded

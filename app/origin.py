"""Only this program's own page may talk to the server.

A web page of any other site can open a websocket to 127.0.0.1, and a site whose name is made to point
there (DNS rebinding) can even read what comes back. Browsers send the site as ``Origin`` and the name
that they looked up as ``Host``: the one has to be the other, and that has to be this machine.
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
"""To a connection and its request: a response, or None to go on to the websocket."""
REFUSED = "PacketMesh answers only its own page: open the address that it printed when it started.\n"


def is_own(headers: Mapping[str, str]) -> bool:
    """Whether a request comes from this server's own page, or from no page at all.

    Args:
        headers: of the request, by name in any case.
    """
    host = headers.get("Host")
    origin = headers.get("Origin")
    if host is None or not _names_this_machine(urlsplit(f"//{host}").hostname or ""):
        return False
    return origin is None or urlsplit(origin).netloc.lower() == host.lower()


def _names_this_machine(name: str) -> bool:
    """Whether a host name cannot be a stranger's: an address, localhost, or what this machine is called."""
    with contextlib.suppress(ValueError):
        ipaddress.ip_address(name)
        return True
    own = {"localhost", socket.gethostname().lower(), socket.getfqdn().lower()}
    return name.lower() in own | {f"{socket.gethostname().lower()}.local"}


def only_own_page() -> AbstractContextManager[None]:
    """Servers that start meanwhile refuse the pages of others."""
    return answering(_guard)


@contextlib.contextmanager
def answering(change: Callable[[Answer], Answer]) -> Iterator[None]:
    """Servers that start meanwhile answer requests with what this makes of their own answer.

    Viser has no option for it.
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
    """The server's own answer to a request, unless it comes from elsewhere."""

    def guarded(connection: Any, request: Any) -> Any:
        if not is_own(request.headers):
            return connection.respond(http.HTTPStatus.FORBIDDEN, REFUSED)
        return answer(connection, request)

    return guarded

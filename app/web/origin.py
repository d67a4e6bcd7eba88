"""Access to the server for its own page only.

A web page of any other site can open a websocket to 127.0.0.1, and a site whose name is made to point there
(DNS rebinding) can even read the answers. Browsers send the site as ``Origin`` and the name that they looked
up as ``Host``: the two must be equal, and must name this machine. The person who starts the server can allow
further names, for a proxy in front of it; a proxy may replace ``Host``, so that an allowed ``Origin`` is
accepted with every ``Host`` of this machine.

Pages cannot see why a websocket is refused, or that a proxy does not pass it on. So the page asks for ``WHY``
and shows the answer.
"""

from __future__ import annotations

import contextlib
import functools
import http
import ipaddress
import math
import re
import socket
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from functools import partial
from typing import Any, TypeAlias
from urllib.parse import parse_qs, urlsplit

from websockets.asyncio import server as websockets_server

from app.web.names import OPTION, host_name

Answer: TypeAlias = Callable[[Any, Any], Any]
"""Takes a connection and its request. Returns a response or an awaitable of one, or None to continue to the
websocket."""
ONCE = ("Host", "Origin", "Upgrade", "Cookie", "Accept-Encoding")
"""Headers that a request may have only once."""
NOT_WELL_FORMED = "This is not a request that PacketMesh understands.\n"
REFUSED = "PacketMesh answers only its own page: open the address that it printed when it started.\n"
WHY = "/why-refused"
"""Path that answers with the reason why a page of ``?origin=`` gets no websocket; empty if it gets one. With
``&waited=1`` the page has tried for ``RECENT_S``."""
NOT_PASSED_ON = (
    "No websocket of this page reaches PacketMesh: let the proxy in front of it pass on websockets, with the "
    "headers Upgrade, Connection and Origin as the browser sends them; if the proxy shows PacketMesh under a "
    "path such as /pm/, also for /pm\n"
)
RECENT_S = 10.0
"""Time within which a waiting page tries to open its websocket at least once, seconds."""
_MOST_ORIGINS = 1000
_NONE: frozenset[str] = frozenset()
_ADDRESS = re.compile(r"[A-Za-z0-9._:\[\]-]{1,260}")


def is_own(headers: Mapping[str, str], allowed: frozenset[str] = _NONE) -> bool:
    """Whether a request is to this server and comes from its own page, or from no page (no ``Origin``).

    Args:
        headers: headers of the request; names in any case.
        allowed: further names of this server, from ``allowed_names``.
    """
    host = headers.get("Host", "")
    origin = headers.get("Origin")
    try:
        name = urlsplit(f"//{host}").hostname or ""
        page = host if origin is None else urlsplit(origin).netloc
    except ValueError:  # an address with an unclosed bracket
        return False
    if not (_names_this_machine(name) or host_name(host) in allowed):
        return False
    return page.lower() == host.lower() or _page_name(origin) in allowed


def _page_name(origin: str | None) -> str | None:
    """Return the host name of a page's origin; None if it has none."""
    protocol, separator, address = (origin or "").partition("://")
    return host_name(address) if separator and protocol in ("http", "https") and "@" not in address else None


def refusal(headers: Mapping[str, str], allowed: frozenset[str] = _NONE) -> str:
    """Return the sentence for a refused request: the address that it used, and the options that allow it.

    A proxy may also replace ``Host`` by a name that it knows the server by, such as a container's: then both
    names have to be allowed.
    """
    missing = dict(_missing(headers, allowed))
    if None in missing or not missing:
        return REFUSED
    shown = " and ".join(missing.values())
    options = " ".join(f"{OPTION} {name}" for name in missing)
    start = f"also with: {options}" if allowed else f"with: packetmesh serve {options}"
    return (
        f"PacketMesh does not answer pages of {shown}: open the address that it printed when it started, or, "
        f"if you reach it through a proxy, start the server {start}\n"
    )


def _missing(headers: Mapping[str, str], allowed: frozenset[str]) -> Iterator[tuple[str | None, str]]:
    """Yield the names that are not allowed, each with the address to show; None if an address has no name."""
    origin, host = headers.get("Origin"), headers.get("Host", "")
    if origin is not None:
        address = origin.partition("://")[2]
        name = _page_name(origin)
        if address.lower() != host.lower() and name not in allowed:
            yield name, _shown(address, name)
    name = host_name(host)
    if name is None or not (_names_this_machine(name) or name in allowed):
        yield name, _shown(host, name)


def _shown(address: str, name: str | None) -> str:
    """Return the address in lower case, with its port; the name if it has characters that no address has."""
    return address.lower() if _ADDRESS.fullmatch(address) else name or ""


def _names_this_machine(name: str) -> bool:
    """Whether a host name can only be this machine: an IP address, localhost, or the machine's own name."""
    with contextlib.suppress(ValueError):
        ipaddress.ip_address(name)
        return True
    own = {"localhost", socket.gethostname().lower(), socket.getfqdn().lower()}
    return name.lower() in own | {f"{socket.gethostname().lower()}.local"}


def well_formed() -> AbstractContextManager[None]:
    """Return a context. A server started in it answers unreadable requests with 400, not 500 as viser."""
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


def only_own_page(allowed: frozenset[str] = _NONE) -> AbstractContextManager[None]:
    """Return a context. A server started in it refuses requests from other sites' pages.

    Args:
        allowed: further names of this server, from ``allowed_names``.
    """
    return answering(partial(_guard, allowed))


@contextlib.contextmanager
def answering(change: Callable[[Answer], Answer], **settings: float) -> Iterator[None]:
    """Open a context. A server started in it answers requests with ``change`` applied to its own answer.

    Viser has no option for this, nor for ``settings`` of websockets' ``serve``.
    """
    serve = websockets_server.serve

    @functools.wraps(serve)
    def changed(*arguments: Any, process_request: Answer, **options: Any) -> Any:
        return serve(*arguments, process_request=change(process_request), **(options | settings))

    setattr(websockets_server, "serve", changed)  # noqa: B010
    try:
        yield
    finally:
        setattr(websockets_server, "serve", serve)  # noqa: B010


def _guard(allowed: frozenset[str], answer: Answer) -> Answer:
    """Return the server's answer function, which now refuses requests from other sites."""
    attempts_s = dict[str, float]()
    """Time at which each origin last requested a websocket, seconds."""

    def guarded(connection: Any, request: Any) -> Any:
        if "Upgrade" in request.headers:
            if len(attempts_s) >= _MOST_ORIGINS:
                attempts_s.clear()
            attempts_s[request.headers.get("Origin", "").lower()] = time.monotonic()
        if not is_own(request.headers, allowed):
            return connection.respond(http.HTTPStatus.FORBIDDEN, refusal(request.headers, allowed))
        path, _, query = request.path.partition("?")
        if path == WHY and "Upgrade" not in request.headers:
            page = {name: values[0] for name, values in parse_qs(query).items()}
            sentence = _why(request.headers.get("Host", ""), page.get("origin", ""), allowed)
            recent_s = time.monotonic() - RECENT_S
            if (
                not sentence
                and "waited" in page
                and attempts_s.get(page["origin"].lower(), -math.inf) < recent_s
            ):
                sentence = NOT_PASSED_ON
            return connection.respond(http.HTTPStatus.OK, sentence)
        return answer(connection, request)

    return guarded


def _why(host: str, origin: str, allowed: frozenset[str]) -> str:
    """Return why a page of this origin gets no websocket under this ``Host``; empty if it gets one."""
    page = {"Host": host, "Origin": origin}
    return "" if is_own(page, allowed) else refusal(page, allowed)

"""Access and the teacher's role: a browser opens a link with a token, which a cookie remembers.

The token is removed from the address at once, so that nobody can read it from a projected screen.
"""

from __future__ import annotations

import hmac
import http
import ipaddress
import secrets
from contextlib import AbstractContextManager
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from typing import Any, Literal
from urllib.parse import parse_qsl, urlencode, urlsplit

from app.web.origin import Answer, answering

WELCOME = "/?welcome"
"""Page to which the teacher's link redirects."""
NOT_THAT = "This is not a link of this server: open the one that was printed when it started.\n"
NO_LINK = "You need the link of this server: open the whole address that it printed when it started.\n"


class Token:
    """The secret in a link."""

    def __init__(self, key: Literal["token", "teacher"]) -> None:
        """Make a token; ``key`` is its name in the link's query."""
        self.key = key
        self.text = secrets.token_urlsafe(16)
        self.cookie = f"packetmesh_{key}_{secrets.token_hex(4)}"
        """Name of its cookie, unique to this server: browsers share cookies between a machine's ports."""

    @property
    def query(self) -> str:
        """The query that makes a server's address a link with this token."""
        return f"?{self.key}={self.text}"

    def is_in(self, cookies: str) -> bool:
        """Whether a request's ``Cookie`` header holds the token."""
        try:
            held = SimpleCookie(cookies).get(self.cookie)
        except CookieError:
            return False
        return held is not None and self.is_text(held.value)

    def is_text(self, text: str) -> bool:
        """Whether ``text`` is the token; the comparison takes constant time."""
        return hmac.compare_digest(text.encode(), self.text.encode())


@dataclass(frozen=True, slots=True)
class Entrance:
    """The tokens of a server."""

    visitor: Token | None = None
    """Token without which only the teacher's browser is admitted; None admits all."""
    teacher: Token | None = None
    """The teacher's token in a lecture."""

    def lets_in(self, cookies: str) -> bool:
        """Whether a browser with these cookies is admitted."""
        return self.visitor is None or any(token.is_in(cookies) for token in self._tokens)

    def guarded(self) -> AbstractContextManager[None]:
        """Return a context. A server started in it sets a valid link's cookie and refuses other browsers."""
        return answering(self._answering)

    @property
    def _tokens(self) -> tuple[Token, ...]:
        return tuple(token for token in (self.visitor, self.teacher) if token is not None)

    def _answering(self, answer: Answer) -> Answer:
        def answered(connection: Any, request: Any) -> Any:
            given = dict(parse_qsl(urlsplit(request.path).query))
            token = next((token for token in self._tokens if token.key in given), None)
            if token is None:
                if self.lets_in(request.headers.get("Cookie", "")):
                    return answer(connection, request)
                return connection.respond(http.HTTPStatus.FORBIDDEN, NO_LINK)
            if not token.is_text(given.pop(token.key)):
                return connection.respond(http.HTTPStatus.FORBIDDEN, NOT_THAT)
            response = connection.respond(http.HTTPStatus.SEE_OTHER, "")
            home = WELCOME if token is self.teacher else "/"
            place = f"/?{urlencode(given)}" if given else home
            response.headers["Location"] = f".{place}"  # relative, because a proxy may add a path
            response.headers["Set-Cookie"] = f"{token.cookie}={token.text}; Path=/; HttpOnly; SameSite=Lax"
            return response

        return answered


def is_loopback(host: str) -> bool:
    """Whether a listening host is reachable from this machine only."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return urlsplit(f"//{host}").hostname == "localhost"


def is_unspecified(host: str) -> bool:
    """Whether a listening host stands for all addresses of this machine: 0.0.0.0 for IPv4, :: for IPv6."""
    try:
        return ipaddress.ip_address(host).is_unspecified
    except ValueError:
        return False

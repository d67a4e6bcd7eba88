"""Who may come in, and who teaches: browsers that came by a link with a token, which a cookie remembers.

The token leaves the address at once, so that nobody reads it from the wall.
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
"""Where the teacher's link leads."""
NOT_THAT = "This is not a link of this server: open the one that was printed when it started.\n"
NO_LINK = "PacketMesh lets in who has its link: open the whole address that it printed when it started.\n"


class Token:
    """What a link holds."""

    def __init__(self, key: Literal["token", "teacher"]) -> None:
        """``key`` stands before it in the link."""
        self.key = key
        self.text = secrets.token_urlsafe(16)
        self.cookie = f"packetmesh_{key}_{secrets.token_hex(4)}"
        """Its name: of this server, as a browser keeps cookies of all ports of a machine together."""

    @property
    def query(self) -> str:
        """Behind the address, it makes the link."""
        return f"?{self.key}={self.text}"

    def is_in(self, cookies: str) -> bool:
        """Whether the header ``Cookie`` of a request holds it."""
        try:
            held = SimpleCookie(cookies).get(self.cookie)
        except CookieError:
            return False
        return held is not None and self.is_text(held.value)

    def is_text(self, text: str) -> bool:
        """Whether it is this one; takes as long for any other of its length."""
        return hmac.compare_digest(text.encode(), self.text.encode())


@dataclass(frozen=True, slots=True)
class Entrance:
    """The links of a server."""

    visitor: Token | None = None
    """Without it, or the teacher's, nobody comes in; None lets all in."""
    teacher: Token | None = None
    """Of a lecture."""

    def lets_in(self, cookies: str) -> bool:
        """Whether a browser with these cookies sees anything."""
        return self.visitor is None or any(token.is_in(cookies) for token in self._tokens)

    def guarded(self) -> AbstractContextManager[None]:
        """Servers that start meanwhile give the cookie to whoever comes by a link, and turn others away."""
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
            response.headers["Location"] = f"/?{urlencode(given)}" if given else home
            response.headers["Set-Cookie"] = f"{token.cookie}={token.text}; Path=/; HttpOnly; SameSite=Lax"
            return response

        return answered


def is_loopback(host: str) -> bool:
    """Whether only this machine reaches a host that is listened on."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return urlsplit(f"//{host}").hostname == "localhost"

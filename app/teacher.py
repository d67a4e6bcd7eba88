"""Who teaches: a browser that came by the link with the token, which a cookie remembers from then on.

The token leaves the address at once, so that nobody reads it from the wall.
"""

from __future__ import annotations

import hmac
import http
import secrets
from contextlib import AbstractContextManager
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

from app.landing import WELCOME
from app.origin import Answer, answering

KEY = "teacher"
"""In the link."""
NOT_THAT = "This is not the teacher's link of this lecture: open the one that was printed when it started.\n"


class Token:
    """What the teacher's link holds."""

    def __init__(self) -> None:
        self.text = secrets.token_urlsafe(16)
        self.cookie = f"packetmesh_{KEY}_{secrets.token_hex(4)}"
        """Its name: of this server, as a browser keeps cookies of all ports of a machine together."""

    @property
    def query(self) -> str:
        """Behind the address, it makes the teacher's link."""
        return f"?{KEY}={self.text}"

    def is_in(self, cookies: str) -> bool:
        """Whether the header ``Cookie`` of a request holds it."""
        try:
            held = SimpleCookie(cookies).get(self.cookie)
        except CookieError:
            return False
        return held is not None and self._is(held.value)

    def _is(self, text: str) -> bool:
        return hmac.compare_digest(text.encode(), self.text.encode())

    def accepted(self) -> AbstractContextManager[None]:
        """Servers that start meanwhile give the cookie to whoever comes by the link."""
        return answering(self._answering)

    def _answering(self, answer: Answer) -> Answer:
        def answered(connection: Any, request: Any) -> Any:
            given = parse_qs(urlsplit(request.path).query).get(KEY)
            if given is None:
                return answer(connection, request)
            if not self._is(given[0]):
                return connection.respond(http.HTTPStatus.FORBIDDEN, NOT_THAT)
            response = connection.respond(http.HTTPStatus.SEE_OTHER, "")
            response.headers["Location"] = WELCOME
            response.headers["Set-Cookie"] = f"{self.cookie}={self.text}; Path=/; HttpOnly; SameSite=Strict"
            return response

        return answered

"""Checks of host names, such as a proxy's, that the person who starts the server allows by --allow-host."""

from __future__ import annotations

import contextlib
import ipaddress
import re
from collections.abc import Iterable
from urllib.parse import urlsplit

from packetmesh.errors import InputError

OPTION = "--allow-host"
_NAME = re.compile(r"(?!-)[a-z0-9_-]{1,63}(?<!-)(\.(?!-)[a-z0-9_-]{1,63}(?<!-))*")
_MOST_LETTERS = 253
_NUMBER = re.compile(r"[0-9]+|0x[0-9a-f]*")
"""A last part that makes browsers read the whole name as an IPv4 address, such as 127.1 or 8080."""


def allowed_names(given: Iterable[str]) -> frozenset[str]:
    """Return host names as browsers send them: lower case, other alphabets in ASCII, no final dot.

    Raises:
        InputError: a name is no host name or IP address.
    """
    return frozenset(map(_allowed, given))


def _allowed(given: str) -> str:
    name = plain_name(given)
    if name is not None:
        return name
    found = host_name(given.partition("://")[2] if "://" in given else given)
    hint = (
        f"{OPTION} {found}"
        if found
        else f"{OPTION} lab.example.org, one name without protocol, port, path and *"
    )
    raise InputError(f"{OPTION} has '{given}', which is not a host name; try {hint}")


def host_name(address: str) -> str | None:
    """Return the name in ``name:port/path``, for example of a ``Host`` header; None if there is none."""
    try:
        return plain_name(urlsplit(f"//{address}").hostname or "")
    except ValueError:  # an address with an unclosed bracket
        return None


def plain_name(text: str) -> str | None:
    """Return a host name or IP address as browsers send it; None if it is neither."""
    bare = text[1:-1] if text.startswith("[") and text.endswith("]") else text
    with contextlib.suppress(ValueError):
        return str(ipaddress.ip_address(bare))
    try:
        name = text.rstrip(".").encode("idna").decode().lower()
    except UnicodeError:
        return None
    if len(name) > _MOST_LETTERS or not _NAME.fullmatch(name) or _NUMBER.fullmatch(name.rpartition(".")[2]):
        return None
    return name

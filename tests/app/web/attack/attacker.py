"""What an attacker can put into the messages of a browser's connection."""

from __future__ import annotations

import contextlib
import math

import viser
from websockets.sync.client import connect

from app.load.connection import Connection, wait_for

ANYTHING = (
    *(None, [], {}, [[]], {"value": 1}, b"", b"\x00\xff", [None], ["a", "b"], [1.0], [1, 2], [1, 2, 3, 4, 5]),
    *(math.nan, math.inf, -math.inf, 1e308, -1e308, 10**18, -(10**18), 2**63, 1e-320),
    *([math.nan, 0.0], [math.nan] * 3, ["1", "2", "3"], [True, False, True], [1e300] * 2, [1e300] * 3),
    *("/tmp/attack", "../../attack", "..\\attack", "\0", "a\nb", "\x1b[31m", "x" * 8000, "\u0085"),
    *("<script>parent.pwned = 1</script>", "{{7*7}}", "__class__", "true", "0", "node_00/../../x"),
)
"""Forty-odd values, most of them wrong for any control."""


def wrong_for(handle):
    """Those that no hand could give a control."""
    if isinstance(handle, viser.GuiTextHandle):
        plain = (one for one in ANYTHING if isinstance(one, str) and one.isprintable() and len(one) <= 7168)
        return without(ANYTHING, plain)
    extra = (True, False, 1, 0.5, "", "a") if isinstance(handle, viser.GuiUploadButtonHandle) else ()
    if isinstance(handle, viser.GuiCheckboxHandle | viser.GuiButtonHandle):
        extra = (0, 1, 2, 0.0, 1.0, "on", "")
    if isinstance(handle, viser.GuiButtonHandle):
        extra = (*extra, False)
    if isinstance(handle, viser.GuiDropdownHandle | viser.GuiButtonGroupHandle):
        extra = ("", handle.options[0] + " ", handle.options[0].upper() + "!", 0, True, list(handle.options))
        return without((*ANYTHING, *extra), (one for one in ANYTHING if one in handle.options))
    if isinstance(handle, viser.GuiNumberHandle | viser.GuiSliderHandle):
        extra = (True, False, "1", handle.value + 0.5 if isinstance(handle.value, int) else math.nan)
        extra += tuple(one for one in (below(handle.min), above(handle.max)) if one is not None)
    return (*ANYTHING, *extra)


def without(values, others):
    """Values that are none of the others."""
    others = list(others)
    return tuple(one for one in values if not any(one is other for other in others))


def below(least):
    """A little less than a bound."""
    return None if least is None else least - 1


def above(most):
    """A little more than a bound."""
    return None if most is None else most + 1


@contextlib.contextmanager
def connected(url, label, cookie=""):
    """A browser's connection, once it has a control of that label."""
    with contextlib.closing(Connection(url, cookie)) as one:
        wait_for(lambda: label in one.uuids, 120.0)
        yield one


def silent_connection(url):
    """A browser's connection that sends nothing by itself."""
    protocols = [f"viser-v{viser.__version__}"]
    return connect(url.replace("http://", "ws://"), subprotocols=protocols, max_size=None, proxy=None)


def receive(connection):
    """Take what the server sends until it closes the connection."""
    while True:
        connection.recv(timeout=30.0)

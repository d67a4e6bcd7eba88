"""Connections to a running app that exchange a page's messages without a page."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable
from typing import Any

import msgspec.msgpack
import viser
import zstandard
from viser import _messages as messages
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from app.window.stepper import MARKS

PATIENCE_S = 30.0
"""Default time limit of ``wait_for``, seconds."""
QUESTIONS = ('data-packetmesh-call="ask"', 'data-packetmesh-call="hold"')
"""Parts of the HTML by which the server asks whether everything is drawn, and whether the page holds."""
DRAWN = "Say that all is drawn"
"""Label of the command with which a page answers."""
OLD = "packetmesh-old"
"""Part of the HTML that dims the numbers or the picture."""
_CURRENT = re.compile(r"nth-of-type\((\d+)\) {[^}]*color: white;")
_MARK = re.compile(r"nth-of-type\((\d+)\) .mantine-Button-label::after {[^}]*00a0(.)'")


def wait_for(happened: Callable[[], bool], patience_s: float = PATIENCE_S) -> None:
    """Wait until ``happened()`` is true.

    Raises:
        TimeoutError: it is not true within ``patience_s``.
    """
    end_s = time.monotonic() + patience_s
    while not happened():
        if time.monotonic() > end_s:
            raise TimeoutError(f"what was awaited did not come within {patience_s:g} s")
        time.sleep(0.02)


class Connection:
    """One simulated browser's connection: its controls by label, and the state that the server sent."""

    def __init__(self, url: str, cookie: str = "") -> None:
        self._socket = connect(
            url.replace("http://", "ws://"),
            subprotocols=[f"viser-v{viser.__version__}"],  # type: ignore[list-item]
            additional_headers={"Cookie": cookie} if cookie else {},
            max_size=None,
            ping_interval=None,  # browsers send none, and on a slow line the answer may take long
        )
        self.uuids: dict[str, list[str]] = {}
        self.commands: dict[str, str] = {}
        """Uuids of the command palette's entries by label; of equal labels, the last."""
        self.values: dict[str, object] = {}
        """The server's last values by the controls' uuids."""
        self.texts: dict[str, str] = {}
        self.positions: list[tuple[float, ...]] = []
        self.notices: list[str] = []
        """Titles and texts of the notifications."""
        self.steps: tuple[str, ...] = ()
        """Labels of the steps."""
        self._marks: dict[str, str] = {}
        self.current = ""
        """The step that is shown."""
        self.shown_s: dict[str, float] = {}
        """``time.monotonic()`` when each step was last shown, and when ``surface`` was last up to date."""
        self._dimmed: set[str] = set()
        """Uuids of HTML that dims outdated numbers or pictures."""
        self.lost = False
        """Whether the server closed the connection."""
        self._drawn: set[str] = set()
        self._closing = False
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.stand((1.0, 2.0, 3.0))

    def close(self) -> None:
        self._closing = True
        self._socket.close()
        self._reader.join()

    def send(self, message: messages.Message) -> None:
        self._socket.send(msgspec.msgpack.encode(message.as_serializable_dict()))

    def stand(self, position: tuple[float, float, float]) -> None:
        """Send a camera position, as if the user had turned the view."""
        up, ahead = (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
        self.send(
            messages.ViewerCameraMessage(
                (1.0, 0.0, 0.0, 0.0), position, 0.9, 0.01, 100.0, 600, 900, ahead, up
            )
        )

    def set(self, label: str, value: object, which: int = 0) -> None:
        """Set the control with this label, once it exists; ``which`` is its index among equal labels.

        Raises:
            TimeoutError: there is no such control within ``PATIENCE_S``.
        """
        wait_for(lambda: len(self.uuids.get(label, ())) > which)
        self.send(messages.GuiUpdateMessage(self.uuids[label][which], {"value": value}))

    def value(self, label: str) -> object:
        return self.values[self.uuids[label][0]]

    def reads(self, text: str) -> bool:
        """Whether a text in the control panel contains ``text``."""
        return any(text in one for one in list(self.texts.values()))

    def go(self, step: str) -> None:
        """Click a step."""
        self.set("Steps", step)

    def mark(self, step: str) -> str:
        """Return the stepper's mark of a step; empty without one."""
        return self._marks.get(step, "")

    def _read(self) -> None:
        try:
            for packet in self._socket:
                assert isinstance(packet, bytes)
                self._take(packet)
        except ConnectionClosed:
            pass
        self.lost = not self._closing

    def _take(self, packet: bytes) -> None:
        size = int.from_bytes(packet[8:16], "little")
        inner = zstandard.ZstdDecompressor().decompress(packet[16 : 16 + size])
        for message in msgspec.msgpack.decode(inner)["messages"]:
            self._take_message(message)

    def _take_message(self, message: dict[str, Any]) -> None:
        if message["type"] == "SetCameraPositionMessage":
            self.positions.append(tuple(message["position"]))
        if "uuid" in message:
            self._take_control(message["uuid"], message)

    def _take_control(self, uuid: str, message: dict[str, object]) -> None:
        props = message.get("props")
        properties = props or message.get("updates") or {}
        assert isinstance(properties, dict)
        if message["type"] == "NotificationShowMessage":
            self.notices.append(f"{properties['title']}: {properties['body']}")
        if message["type"] == "RegisterCommandMessage":
            self.commands[properties["label"]] = uuid
            if properties["label"] == DRAWN:
                self._drawn.add(uuid)
        elif props is not None and properties.get("label"):
            self.uuids.setdefault(properties["label"], []).append(uuid)
        if "_markdown" in properties:
            self.texts[uuid] = properties["_markdown"]
        if "content" in properties:
            self._take_html(uuid, properties["content"])
        if "options" in properties and uuid in self.uuids.get("Steps", ()):
            self.steps = tuple(properties["options"])
        value = message.get("value", properties.get("value"))
        if value is not None:
            self.values[uuid] = value

    def _take_html(self, uuid: str, content: str) -> None:
        """Record the step and whether HTML is dimmed; answer if the server asks."""
        if any(question in content for question in QUESTIONS):
            self._answer_drawn()
        current = _CURRENT.search(content)
        if current is not None and self.steps:
            step = self.steps[int(current[1]) - 1]
            self.shown_s[step] = time.monotonic()
            self.current = step  # last, as another thread waits for it and then reads the time
            self._marks = {self.steps[int(number) - 1]: mark for number, mark in _MARK.findall(content)}
            self._note_surface()
        if OLD in content:
            self._dimmed.add(uuid)
        elif uuid in self._dimmed:
            self._dimmed.remove(uuid)
            self._note_surface()

    def _answer_drawn(self) -> None:
        """Confirm that all is drawn."""
        for command in self._drawn:
            self.send(messages.CommandTriggerMessage(command))

    def _note_surface(self) -> None:
        if self.mark("Surface") == MARKS["fresh"] and not self._dimmed:
            self.shown_s["surface"] = time.monotonic()

"""Connections to a running app that say and hear what a page does, without a page."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import msgspec.msgpack
import viser
import zstandard
from viser import _messages as messages
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

PATIENCE_S = 30.0


def wait_for(happened: Callable[[], bool]) -> None:
    """Return once it has; an AssertionError if it has not for long."""
    end_s = time.monotonic() + PATIENCE_S
    while not happened():
        assert time.monotonic() < end_s, "that did not happen"
        time.sleep(0.02)


class Connection:
    """One browser's connection: its controls by their labels, and what it was told of its camera."""

    def __init__(self, url: str, cookie: str = "") -> None:
        self._socket = connect(
            url.replace("http://", "ws://"),
            subprotocols=[f"viser-v{viser.__version__}"],
            additional_headers={"Cookie": cookie} if cookie else {},
            max_size=None,
        )
        self.uuids: dict[str, list[str]] = {}
        self.values: dict[str, object] = {}
        """By the control's uuid, what the server said last."""
        self.texts: dict[str, str] = {}
        self.positions: list[tuple[float, ...]] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.stand((1.0, 2.0, 3.0))

    def close(self) -> None:
        self._socket.close()
        self._reader.join()

    def say(self, message: messages.Message) -> None:
        self._socket.send(msgspec.msgpack.encode(message.as_serializable_dict()))

    def stand(self, position: tuple[float, float, float]) -> None:
        """Where a hand has turned the view to."""
        up, ahead = (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
        self.say(
            messages.ViewerCameraMessage(
                (1.0, 0.0, 0.0, 0.0), position, 0.9, 0.01, 100.0, 600, 900, ahead, up
            )
        )

    def set(self, label: str, value: object, which: int = 0) -> None:
        """What a hand does with the control of that label, or with the one ``which`` of many."""
        wait_for(lambda: len(self.uuids.get(label, ())) > which)
        self.say(messages.GuiUpdateMessage(self.uuids[label][which], {"value": value}))

    def value(self, label: str) -> object:
        return self.values[self.uuids[label][0]]

    def reads(self, text: str) -> bool:
        """Whether some text in the control panel has it."""
        return any(text in one for one in list(self.texts.values()))

    def _read(self) -> None:
        try:
            for packet in self._socket:
                self._take(packet)
        except ConnectionClosed:
            pass

    def _take(self, packet: bytes) -> None:
        size = int.from_bytes(packet[8:16], "little")
        inner = zstandard.ZstdDecompressor().decompress(packet[16 : 16 + size])
        for message in msgspec.msgpack.decode(inner)["messages"]:
            if message["type"] == "SetCameraPositionMessage":
                self.positions.append(tuple(message["position"]))
            if "uuid" not in message:
                continue
            told = message.get("props", message.get("updates", {}))
            if "props" in message and "label" in told:
                self.uuids.setdefault(told["label"], []).append(message["uuid"])
            if "_markdown" in told:
                self.texts[message["uuid"]] = told["_markdown"]
            value = message.get("value", told.get("value"))
            if value is not None:
                self.values[message["uuid"]] = value

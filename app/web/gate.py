"""Checks of all messages from browsers: only what a user could have done on the page passes.

``RULES`` has a rule for each kind of message that is allowed, and ``VALUES`` one for each kind of control:
the values that a user can give it. Other messages are dropped and counted. A connection that keeps sending
messages that no page sends is closed.
"""

from __future__ import annotations

import logging
import math
import struct
import time
from collections import Counter
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any
from unicodedata import category

import viser
from viser import _messages as messages

from app.web import viser_private as private
from app.web.upload_gate import REFUSED, UploadGate

MOST_TEXT = 7168
"""Longest text in a text field, characters."""
MOST_NAME = 1024
"""Longest name, such as a file's, characters."""
FARTHEST = 1e7
"""Largest coordinate in the scene, metres."""
MOST_PIXELS = 100_000
"""Largest width and height of a browser's view, pixels."""
MOST_VIEW_PX = 8192
"""Largest width and height of a picture of the view, pixels: what graphics cards draw."""
PNG = b"\x89PNG\r\n\x1a\n"
MOST_FORGED = 60
"""Number of messages that no page sends after which the connection is closed."""
MOST_AT_ONCE, MOST_A_SECOND = 1000.0, 200.0
"""Messages other than parts of accepted files: the largest burst, and the rate per second after it."""
FLOOD, FORGED_CLOSE = "more than a hand can do", 1008

logger = logging.getLogger(__name__)


class Verdict(Enum):
    """The result of a check."""

    PASSES = "passes"
    LATE = "late"
    """A page may have sent it, but its target has changed meanwhile or its value is half typed: dropped."""
    FORGED = "forged"
    """No page sends it: dropped; many of them close the connection."""
    REFUSED = "refused"
    """It changes a shared control that this browser must not use."""


@dataclass(slots=True)
class _Guest:
    """A connection and a record of its messages."""

    uploads: UploadGate = field(default_factory=UploadGate)
    shows_page: bool = False
    """Whether it has sent more than camera messages, as a shown page does at once."""
    forged: int = 0
    allowance: float = MOST_AT_ONCE
    counted_s: float = field(default_factory=time.monotonic)


class Gate:
    """Checks the messages of all browsers of a server, on the thread of its connections."""

    def __init__(self, server: viser.ViserServer) -> None:
        """Start checking. Create the gate with the server, so that it checks all browsers."""
        self._server = server
        self._guests: dict[int, _Guest] = {}
        self.dropped: Counter[str] = Counter()
        """Number of dropped messages by verdict and kind of message."""
        self.may_steer: Callable[[int], bool] = lambda _: True
        """Whether the browser with this number may use shared controls."""
        self.on_refused: Callable[[int], None] = lambda _: None
        """Called with the number of a browser that was refused a shared control or command."""
        self.on_too_much: Callable[[int, str], None] = lambda *_: None
        """Called with the number of a browser that uploads too much, and a sentence for its user."""
        private.listen(server, self._on_message)
        private.on_closed(server, lambda number: self._guests.pop(number, None))

    def shows_page(self, number: int) -> bool:
        """Return whether a browser has sent a message that only a shown page sends."""
        return number in self._guests and self._guests[number].shows_page

    async def _on_message(self, number: int, message: Any, go_on: Callable[[], Awaitable[None]]) -> None:
        guest = self._guests.setdefault(number, _Guest())
        is_part = isinstance(message, messages.FileTransferPart)
        if not (is_part and guest.uploads.awaits(message.transfer_uuid)) and not _within_rate(guest):
            self.dropped[FLOOD] += 1
            return
        rule = RULES.get(type(message), _judge_unknown)
        verdict = rule(self, number, message)
        if verdict is Verdict.PASSES:
            guest.shows_page |= not isinstance(message, messages.ViewerCameraMessage)
            await go_on()
            return
        self.dropped[f"{verdict.value} {type(message).__name__}"] += 1
        if verdict is Verdict.FORGED:
            guest.forged += 1
            if guest.forged == MOST_FORGED:
                logger.warning("closed a connection that sent %d messages that no page sends", MOST_FORGED)
                private.close(self._server, number, FORGED_CLOSE, "not a page of this server")

    def _touch(self, number: int, found: tuple[Any, bool] | None) -> Verdict:
        """Judge whether a browser may use the control or node that was found; None is forged."""
        if found is None:
            return Verdict.FORGED
        return Verdict.PASSES if not found[1] or self.may_steer(number) else Verdict.REFUSED

    # One rule for every kind of message.

    def update(self, number: int, message: messages.GuiUpdateMessage) -> Verdict:
        """Check a changed control or a pressed button."""
        found = private.find_control(self._server, number, message.uuid) if _is_name(message.uuid) else None
        updates = message.updates
        if found is None or not isinstance(updates, dict) or list(updates) != ["value"]:
            return Verdict.FORGED
        handle, value = found[0], updates["value"]
        judge = next((judge for kind, judge in VALUES.items() if isinstance(handle, kind)), None)
        verdict = Verdict.FORGED if judge is None else judge(handle, value)
        if verdict is Verdict.FORGED:
            return verdict
        if (touched := self._touch(number, found)) is not Verdict.PASSES:
            private.send_value(self._server, number, handle)
            self.on_refused(number)
            return touched
        if not private.is_live(handle):
            private.send_value(self._server, number, handle)
            return Verdict.LATE
        return verdict

    def command(self, number: int, message: messages.CommandTriggerMessage) -> Verdict:
        """Check a command that was chosen in the palette or by its keys."""
        found = private.find_command(self._server, number, message.uuid) if _is_name(message.uuid) else None
        if found is not None and (found[0]._impl.removed or found[0].disabled):
            return Verdict.LATE
        if (touched := self._touch(number, found)) is Verdict.REFUSED:
            self.on_refused(number)
        return touched

    def begin_upload(self, number: int, message: messages.FileTransferStartUpload) -> Verdict:
        """Check the start of an upload."""
        names = (message.source_component_uuid, message.transfer_uuid, message.filename, message.mime_type)
        sizes = (message.part_count, message.size_bytes)
        if not all(map(_is_name, names)) or not all(type(size) is int for size in sizes):
            return Verdict.FORGED
        found = private.find_control(self._server, number, message.source_component_uuid)
        if found is None or not isinstance(found[0], viser.GuiUploadButtonHandle):
            return Verdict.FORGED
        if not private.is_live(found[0]) or number not in self._server.get_clients():
            return Verdict.LATE  # of a browser that sent no view, viser would keep the parts when it leaves
        if (touched := self._touch(number, found)) is not Verdict.PASSES:
            self.on_refused(number)
            return touched
        uploads = self._guests[number].uploads
        if not uploads.begins(message.size_bytes, message.part_count, message.transfer_uuid):
            self.on_too_much(number, REFUSED)
            return Verdict.LATE
        return Verdict.PASSES

    def part(self, number: int, message: messages.FileTransferPart) -> Verdict:
        """Check a part of an uploaded file."""
        transfer, content = message.transfer_uuid, message.content
        if not _is_name(transfer) or type(message.part_index) is not int or not isinstance(content, bytes):
            return Verdict.FORGED
        known = self._guests[number].uploads.goes_on(transfer, len(content))
        return Verdict.PASSES if known else Verdict.LATE

    def acknowledgement(self, number: int, message: messages.FileTransferPartAck) -> Verdict:
        """Check a browser's receipt for a part of a file."""
        sizes = (message.transferred_bytes, message.total_bytes)
        whole = _is_name(message.transfer_uuid) and all(type(size) is int for size in sizes)
        return Verdict.PASSES if whole else Verdict.FORGED

    def camera(self, number: int, message: messages.ViewerCameraMessage) -> Verdict:
        """Check a changed view or window size."""
        places = (message.position, message.look_at, message.up_direction)
        lens = (message.fov, message.near, message.far)
        sizes = (message.image_height, message.image_width)
        whole = (
            all(_are_numbers(place, 3) for place in places)
            and _is_turn(message.wxyz)
            and _are_numbers(lens, 3)
            and 0.0 < message.fov < math.pi
            and 0.0 < message.near < message.far
            and all(type(size) is int and 0 <= size <= MOST_PIXELS for size in sizes)
        )
        if not whole:
            return Verdict.FORGED
        return Verdict.PASSES if all(sizes) else Verdict.LATE  # the window shows no picture now

    def pointer(self, number: int, message: messages.ScenePointerMessage) -> Verdict:
        """Check a click into the scene."""
        ray = (message.ray_origin, message.ray_direction)
        whole = (
            message.event_type == "click"
            and all(_are_numbers(one, 3) for one in ray)
            and message.modifier is None
            and isinstance(message.screen_pos, tuple | list)
            and 1 <= len(message.screen_pos) <= 2
            and all(_are_numbers(one, 2) for one in message.screen_pos)
        )
        return self._touch(number, (None, True)) if whole else Verdict.FORGED

    def node(self, number: int, message: messages.SceneNodeClickMessage) -> Verdict:
        """Check a click on an object of the scene."""
        ray = (message.ray_origin, message.ray_direction)
        whole = (
            _is_name(message.name)
            and isinstance(message.owner, str)
            and message.instance_index is None
            and message.modifier is None
            and all(_are_numbers(one, 3) for one in ray)
            and _are_numbers(message.screen_pos, 2)
        )
        if not whole:
            return Verdict.FORGED
        found = private.find_node(self._server, number, message.name, message.owner)
        if found is None or not found[0].visible:
            return Verdict.LATE  # nodes come and go with the drawing
        return self._touch(number, found)

    def gizmo(self, number: int, message: Any) -> Verdict:
        """Check that a transform gizmo in the scene was grabbed, dragged or released."""
        moves = isinstance(message, messages.TransformControlsUpdateMessage)
        if not _is_name(message.name) or not isinstance(message.owner, str):
            return Verdict.FORGED
        if moves and not (_are_numbers(message.position, 3) and _is_turn(message.wxyz)):
            return Verdict.FORGED
        found = private.find_node(self._server, number, message.name, message.owner)
        if found is None or not isinstance(found[0], viser.TransformControlsHandle):
            return Verdict.LATE  # gizmos come and go with the drawing
        return self._touch(number, found) if found[0].visible else Verdict.LATE

    def render(self, number: int, message: messages.GetRenderResponseMessage) -> Verdict:
        """Check a picture of the view that the server requested."""
        if not _is_name(message.render_uuid) or not _is_picture(message.payload):
            return Verdict.FORGED
        awaited = private.awaits_render(self._server, number)
        return Verdict.PASSES if awaited else Verdict.LATE


def _judge_unknown(gate: Gate, number: int, message: Any) -> Verdict:
    return Verdict.FORGED


RULES: Mapping[type, Callable[[Gate, int, Any], Verdict]] = {
    messages.GuiUpdateMessage: Gate.update,
    messages.CommandTriggerMessage: Gate.command,
    messages.FileTransferStartUpload: Gate.begin_upload,
    messages.FileTransferPart: Gate.part,
    messages.FileTransferPartAck: Gate.acknowledgement,
    messages.ViewerCameraMessage: Gate.camera,
    messages.ScenePointerMessage: Gate.pointer,
    messages.SceneNodeClickMessage: Gate.node,
    messages.TransformControlsDragStartMessage: Gate.gizmo,
    messages.TransformControlsUpdateMessage: Gate.gizmo,
    messages.TransformControlsDragEndMessage: Gate.gizmo,
    messages.GetRenderResponseMessage: Gate.render,
}
"""All messages that are allowed. The app has no forms, held buttons, draggable nodes or shared links."""


def _check_flag(handle: Any, value: object) -> Verdict:
    return Verdict.PASSES if isinstance(value, bool) else Verdict.FORGED


def _check_press(handle: Any, value: object) -> Verdict:
    return Verdict.PASSES if value is True else Verdict.FORGED


def _check_text(handle: Any, value: object) -> Verdict:
    """Check a line of text: no control characters, not too long."""
    if not isinstance(value, str) or any(category(letter) in ("Cc", "Cs") for letter in value[:MOST_TEXT]):
        return Verdict.FORGED
    return Verdict.PASSES if len(value) <= MOST_TEXT else Verdict.LATE


def _check_option(handle: Any, value: object) -> Verdict:
    """Check a chosen option; the list may have had other options when it was opened."""
    if not isinstance(value, str) or len(value) > MOST_TEXT:
        return Verdict.FORGED
    if value in handle.options:
        return Verdict.PASSES
    return Verdict.LATE


def _check_number(handle: Any, value: object) -> Verdict:
    """Check a number: within the control's bounds, with no more decimals than it shows."""
    return _number_verdict(handle, value, handle.value, handle.min, handle.max)


def _check_vector(handle: Any, value: object) -> Verdict:
    """Check each number of a vector like ``_check_number``."""
    count = len(handle.value)
    if not isinstance(value, tuple | list) or len(value) != count:
        return Verdict.FORGED
    least, most = (handle.min or (None,) * count), (handle.max or (None,) * count)
    each = [_number_verdict(handle, *one) for one in zip(value, handle.value, least, most, strict=True)]
    return next((verdict for verdict in each if verdict is not Verdict.PASSES), Verdict.PASSES)


def _number_verdict(handle: Any, value: Any, now: float, least: float | None, most: float | None) -> Verdict:
    if not _is_number(value) or (isinstance(now, int) and value != int(value)):
        return Verdict.FORGED
    digits = handle.precision
    low = -math.inf if least is None else min(least, round(least, digits))
    high = math.inf if most is None else max(most, round(most, digits))
    if not low <= value <= high:
        return Verdict.LATE  # half typed
    shown = abs(value - round(value, digits)) <= 1e-9 * abs(value) or value in (least, most)
    return Verdict.PASSES if shown else Verdict.FORGED


VALUES: Mapping[type, Callable[[Any, object], Verdict]] = {
    viser.GuiCheckboxHandle: _check_flag,
    viser.GuiButtonHandle: _check_press,
    viser.GuiTextHandle: _check_text,
    viser.GuiDropdownHandle: _check_option,
    viser.GuiButtonGroupHandle: _check_option,
    viser.GuiNumberHandle: _check_number,
    viser.GuiSliderHandle: _check_number,
    viser.GuiVector2Handle: _check_vector,
    viser.GuiVector3Handle: _check_vector,
}
"""Checks of the values that a user can give a control; a browser cannot set other kinds of controls."""


def _within_rate(guest: _Guest) -> bool:
    """Use up one message of a connection's allowance, which grows with time. False if it is empty."""
    now_s = time.monotonic()
    more = MOST_A_SECOND * (now_s - guest.counted_s)
    guest.allowance, guest.counted_s = min(guest.allowance + more, MOST_AT_ONCE), now_s
    if guest.allowance < 1.0:
        return False
    guest.allowance -= 1.0
    return True


def _is_name(text: object) -> bool:
    return isinstance(text, str) and len(text) <= MOST_NAME


def _is_picture(payload: object) -> bool:
    """Whether a payload is empty (the page could not draw) or a PNG file of up to ``MOST_VIEW_PX`` a side."""
    if payload == b"":
        return True
    if not isinstance(payload, bytes) or not payload.startswith(PNG) or len(payload) < 24:
        return False
    return all(1 <= size <= MOST_VIEW_PX for size in struct.unpack(">2I", payload[16:24]))


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= FARTHEST


def _are_numbers(values: object, count: int) -> bool:
    return isinstance(values, tuple | list) and len(values) == count and all(map(_is_number, values))


def _is_turn(wxyz: Any) -> bool:
    """Whether the value is a unit quaternion to a browser's float32 precision."""
    return _are_numbers(wxyz, 4) and abs(sum(value * value for value in wxyz) - 1.0) < 1e-2

"""A lecture: one session for all browsers, which a teacher steers and a class follows, votes in, or looks
around in.

Whoever came by the teacher's link teaches. What others do with a control that all share is not heard, except
for votes, until the teacher lets the class steer.
"""

from __future__ import annotations

import json
import re
import uuid
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias
from urllib.parse import urlsplit

import viser
from viser import _messages as messages

from app.dock_row import add_hidden
from app.drawing.cameras import turn
from app.entrance import Token, is_loopback
from app.page import running
from app.qr import qr_html
from app.ui import Ui

HEARD = (messages.FileTransferPartAck, messages.GetRenderResponseMessage, messages.ViewerCameraMessage)
"""Of what a browser sends, that which changes nothing for others."""
SAID = re.compile(r"\d+ (?:(follow)|(roam)|vote ([123]))")
"""What the page of somebody in the class says; a number tells two apart that are alike."""
UNREACHED = (
    "<b>No other machine reaches this address.</b> Stop the lecture and start it again with "
    "<code>--host 0.0.0.0</code>; then it is one that the class can open."
)
"""Of an address of this machine alone."""
Count: TypeAlias = Callable[[int, int], None]
"""Counts the vote of a voter, both by their numbers; choices count from 1."""
_SCRIPT, _STYLE = (Path(__file__).with_suffix(kind).read_text(encoding="utf-8") for kind in (".js", ".css"))


@dataclass(slots=True)
class _Seat:
    """A browser of the class."""

    client: viser.ClientHandle
    teaches: bool
    follows: bool = True
    vote: int = 0
    """Of 1 to 3; 0 is none."""
    say: Callable[[str], None] = lambda _: None
    """Runs a script in its page."""
    tell: Callable[[str], None] = lambda _: None
    """Shows the teacher how many are there, in markdown."""
    leave: Callable[[], None] = lambda: None
    """Has the teacher's address no longer follow."""


class Lecture:
    """Everybody who is there. All but what the browsers send runs on the session's thread."""

    def __init__(self, server: viser.ViserServer, token: Token, class_url: str) -> None:
        """Nobody steers but who holds the token; the class comes by the address ``class_url``."""
        self._server, self._token, self._url = server, token, class_url
        self._seats: dict[int, _Seat] = {}
        self._count_vote: Count | None = None
        """While a question waits for votes."""
        self._all_steer = False
        self._leading = False
        self._hear = server._websock_server._handle_incoming_message
        setattr(server._websock_server, "_handle_incoming_message", self._heard)  # noqa: B010

    def begin(
        self,
        post: Callable[..., None],
        frame: Callable[[], None],
        add_address: Callable[[Ui], Callable[[], None]],
    ) -> None:
        """Let browsers in.

        Args:
            post: runs a function on the session's thread.
            frame: turns the followers' views to what the screen shows.
            add_address: has a browser's address follow what is shown, and be followed, until what it returns
                is called.
        """
        self._post, self._frame, self._add_address = post, frame, add_address
        self._server.on_client_connect(lambda client: post(self._join, client))
        self._server.on_client_disconnect(lambda client: post(self._leave, client.client_id))

    def followers(self) -> list[viser.ClientHandle]:
        """The browsers whose view is turned for them."""
        return [seat.client for seat in self._present() if seat.follows]

    def everybody(self) -> Iterable[viser.ClientHandle]:
        """All browsers."""
        return self._server.get_clients().values()

    def poll(self, count: Count | None) -> None:
        """Have the class vote, or no longer; what they voted before is dropped."""
        self._count_vote = count
        for seat in self._present():
            seat.vote = 0
            self._show(seat)

    @property
    def class_size(self) -> int:
        """Browsers that do not teach."""
        return sum(not seat.teaches for seat in self._seats.values())

    # Who comes and goes, and what they look at.

    def _join(self, client: viser.ClientHandle) -> None:
        seat = _Seat(client, self._teaches(client.client_id))
        self._seats[client.client_id] = seat
        if seat.teaches:
            self._add_desk(seat)
            seat.leave = self._add_address(self._own_ui(client))
            client.camera.on_update(lambda _: self._moved(seat))
        else:
            self._add_chip(seat)
        self._catch_up(seat)
        self._count()

    def _leave(self, number: int) -> None:
        seat = self._seats.pop(number, None)
        if seat is not None:
            seat.leave()
        self._count()

    def _leader(self) -> _Seat | None:
        return next((seat for seat in self._present() if seat.teaches), None)

    def _present(self) -> list[_Seat]:
        """All but those who have just gone, to whom nothing more can be said."""
        there = self._server.get_clients()
        return [seat for number, seat in self._seats.items() if number in there]

    def _catch_up(self, seat: _Seat) -> None:
        """Turn a browser to what the class sees."""
        leader = self._leader()
        if leader is None or leader is seat:
            self._frame()
        else:
            _turn_as(leader.client, seat.client)

    def _moved(self, leader: _Seat) -> None:
        """The teacher's view has changed; of many changes at once the last one is passed on."""
        if not self._leading and leader is self._leader():
            self._leading = True
            self._post(self._lead, leader)

    def _lead(self, leader: _Seat) -> None:
        self._leading = False
        for seat in self._present():
            if seat is not leader and seat.follows:
                _turn_as(leader.client, seat.client)

    # What a browser shows of it.

    def _add_desk(self, seat: _Seat) -> None:
        """The teacher's own controls."""
        client = seat.client
        with client.gui.add_folder("Lecture", order=-1.0):
            told = client.gui.add_markdown("")
            seat.tell = partial(setattr, told, "content")
            steer = client.gui.add_checkbox(
                "The class may steer",
                self._all_steer,
                hint="Whether the controls of the class do something, too. Without it they vote and look "
                "around, each on their own.",
            )
            steer.on_update(lambda _: self._post(self._let_steer, steer.value))
            show = client.gui.add_button("Address of the class", hint="As a text and as a QR code.")
            show.on_click(lambda _: self._post(self._show_address, client))

    def _show_address(self, client: viser.ClientHandle) -> None:
        with client.gui.add_modal("Join the class") as modal:
            warning = (
                f'<div class="warning">{UNREACHED}</div>'
                if is_loopback(urlsplit(self._url).hostname or "")
                else ""
            )
            shown = f'<div class="packetmesh-join">{warning}{qr_html(self._url)}<p>{self._url}</p></div>'
            client.gui.add_html(f"{shown}<style>{_STYLE}</style>")
            client.gui.add_button("Close").on_click(lambda _: modal.close())

    def _let_steer(self, all_steer: bool) -> None:
        self._all_steer = all_steer
        for seat in self._present():
            self._show(seat)

    def _count(self) -> None:
        following = sum(seat.follows for seat in self._seats.values() if not seat.teaches)
        size = self.class_size
        told = f"**{size}** in the class, **{following}** of them follow your view."
        for seat in self._present():
            seat.tell(told if size else "**Nobody is in the class yet.**")

    def _add_chip(self, seat: _Seat) -> None:
        """What is told somebody in the class."""
        client, name = seat.client, uuid.uuid4().hex
        ui = self._own_ui(client)
        begin = f"; window.packetmeshLecture.begin({json.dumps(name)})"
        with add_hidden(ui, name, _SCRIPT + begin):
            field = client.gui.add_text("Seat", "")
            html = client.gui.add_html(f"<style>{_STYLE}</style>")
        said = 0

        def say(script: str) -> None:
            nonlocal said
            said += 1
            html.content = f"<style>{_STYLE}</style>{running(script, said)}"

        def hear() -> None:
            heard = SAID.fullmatch(field.value)
            if heard is None:
                return
            follow, _, vote = heard.groups()
            if vote is not None:
                self._vote(seat, int(vote))
                return
            seat.follows = follow is not None
            if seat.follows:
                self._catch_up(seat)
            self._show(seat)
            self._count()

        seat.say = say
        ui.when_changed(field, hear)
        self._show(seat)

    def _own_ui(self, client: viser.ClientHandle) -> Ui:
        """For what one browser has beside what all share."""
        return Ui(client.gui, client.scene, self._post, client.atomic, client.flush)

    def _show(self, seat: _Seat) -> None:
        state = {
            "follows": seat.follows,
            "steers": self._all_steer,
            "asks": self._count_vote is not None,
            "vote": seat.vote,
        }
        seat.say(f"window.packetmeshLecture?.show({json.dumps(state)})")

    def _vote(self, seat: _Seat, vote: int) -> None:
        if self._count_vote is not None:
            seat.vote = vote
            self._count_vote(seat.client.client_id, vote)

    # Who is heard, on the thread of the connections.

    async def _heard(self, number: Any, message: Any) -> None:
        """Pass on what a browser sends to what all share, unless it must not touch it."""
        if self._all_steer or isinstance(message, HEARD) or self._teaches(number):
            await self._hear(number, message)
        elif isinstance(message, messages.GuiUpdateMessage):
            self._post(self._refuse, number, message.uuid)

    def _teaches(self, number: int) -> bool:
        connection = self._server._websock_server._live_connections.get(number)
        request = None if connection is None else connection.request
        return request is not None and self._token.is_in(request.headers.get("Cookie", ""))

    def _refuse(self, number: int, control: str) -> None:
        """Give a control back the value that it has for all."""
        seat = self._seats.get(number)
        handle = self._server.gui._gui_input_handle_from_uuid.get(control)
        if seat is None or handle is None:
            return
        if not handle._impl.is_button:
            back = messages.GuiUpdateMessage(control, {"value": handle._impl.value})
            seat.client._websock_connection.queue_message(back)
        seat.say("window.packetmeshLecture?.refuse()")


def _turn_as(leader: viser.ClientHandle, client: viser.ClientHandle) -> None:
    """Turn a browser's view to what another one's shows."""
    turn(client, leader.camera.look_at, leader.camera.position)
    client.camera.fov = leader.camera.fov

"""A lecture: one session for all browsers. A teacher steers it; the class follows, votes and may look around.

A browser that opened the teacher's link teaches. The server ignores what other browsers do with shared
controls until the teacher lets the class steer.
"""

from __future__ import annotations

import base64
import itertools
import re
import uuid
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from urllib.parse import urlsplit

import cv2
import viser

from app.drawing.cameras import turn
from app.web import viser_private as private
from app.web.entrance import Token, is_loopback
from app.web.gate import Gate
from app.web.markup import Markdown, Markup
from app.window.gui import Gui
from app.window.hidden import add_hidden
from app.window.page import page_call
from app.window.ui import Count, Ui
from pipeline.types import ByteArray

STUDENT_MESSAGE = re.compile(r"\d+ (?:(follow)|(roam)|vote ([123]) ([0-9a-f]{32}))")
"""A message of a student's page: its number, which makes equal messages differ, and its content; a vote has
the random id that the browser keeps, because every reload is a new connection.
"""
UNREACHED = Markup(
    "<b>No other machine reaches this address.</b> Stop the lecture and start it again with <code>--host "
    "0.0.0.0</code>; then the class can open its address."
)
"""Warning for an address that only this machine can reach."""


@dataclass(slots=True)
class _Seat:
    """One browser in the lecture."""

    client: viser.ClientHandle
    teaches: bool
    follows: bool = True
    vote: int = 0
    """The vote, 1 to 3; 0 for none."""
    voter: str = ""
    """Id under which this connection's votes count, that of its first one: only its last vote counts."""
    call: Callable[..., None] = lambda *_: None
    """Calls a function of the seat's page: its name, then its arguments."""
    show_size: Callable[[Markdown], None] = lambda _: None
    """Shows the teacher the number of students, in markdown."""
    leave: Callable[[], None] = lambda: None
    """Stops updating the teacher's address."""
    forget: Callable[[], None] = lambda: None
    """Stops offering the browser its own commands."""


class Lecture:
    """All browsers of a lecture. Methods run on the session's thread, except those that check messages."""

    def __init__(self, server: viser.ViserServer, gate: Gate, token: Token, class_url: str) -> None:
        """Allow only browsers with the teacher's token to steer; the class opens ``class_url``."""
        self._server, self._token, self._url = server, token, class_url
        self._seats: dict[int, _Seat] = {}
        self._count_vote: Count | None = None
        """Receives the votes while a question is open; else None."""
        self._all_steer = False
        self._leading = False
        gate.may_steer = self._may_steer
        gate.on_refused = lambda number: self._post(self._refuse, number)

    def begin(
        self,
        post: Callable[..., None],
        frame: Callable[[], None],
        add_address: Callable[[Ui], Callable[[], None]],
        add_commands: Callable[[Ui, viser.ClientHandle, Callable[[], None]], Callable[[], None]],
    ) -> None:
        """Accept browsers.

        Args:
            post: runs a function on the session's thread.
            frame: turns the followers' views to what the screen shows.
            add_address: connects a browser's address to the session; it returns the function that disconnects
                it.
            add_commands: offers a browser its own commands and takes a function that is called after one of
                them has turned its view; it returns the function that stops offering them.
        """
        self._post, self._frame, self._add_address = post, frame, add_address
        self._add_commands = add_commands
        self._server.on_client_connect(lambda client: post(self._join, client))
        self._server.on_client_disconnect(lambda client: post(self._leave, client.client_id))

    def followers(self) -> list[viser.ClientHandle]:
        """Return the browsers whose view the session turns: the teachers', and students' that follow."""
        return [seat.client for seat in self._present() if seat.follows]

    def everybody(self) -> Iterable[viser.ClientHandle]:
        """Return all browsers."""
        return self._server.get_clients().values()

    def poll(self, count: Count | None) -> None:
        """Open a vote and pass each vote to ``count``, or close it (None). Pages forget earlier votes."""
        self._count_vote = count
        for seat in self._present():
            seat.vote = 0
            self._show(seat)

    @property
    def class_size(self) -> int:
        """Number of browsers that do not teach."""
        return sum(not seat.teaches for seat in self._seats.values())

    # Browsers that join and leave, and their views.

    def _join(self, client: viser.ClientHandle) -> None:
        seat = _Seat(client, self._teaches(client.client_id))
        self._seats[client.client_id] = seat
        if seat.teaches:
            self._add_teacher_folder(seat)
            seat.leave = self._add_address(self._own_ui(client))
            client.camera.on_update(lambda _: self._moved(seat))
        else:
            self._add_bar(seat)
        seat.forget = self._add_commands(self._own_ui(client), client, lambda: self._let_roam(seat))
        self._catch_up(seat)
        self._count()

    def _let_roam(self, seat: _Seat) -> None:
        """Let a student keep the view to which a command has turned it."""
        if not seat.teaches and seat.follows:
            seat.follows = False
            self._show(seat)
            self._count()

    def _leave(self, number: int) -> None:
        seat = self._seats.pop(number, None)
        if seat is not None:
            seat.leave()
            seat.forget()
        self._count()

    def _leader(self) -> _Seat | None:
        return next((seat for seat in self._present() if seat.teaches), None)

    def _present(self) -> list[_Seat]:
        """Return the seats whose browser is still connected."""
        there = self._server.get_clients()
        return [seat for number, seat in self._seats.items() if number in there]

    def _catch_up(self, seat: _Seat) -> None:
        """Turn a browser's view to the one that the class sees."""
        leader = self._leader()
        if leader is None or leader is seat:
            self._frame()
        else:
            _turn_as(leader.client, seat.client)

    def _moved(self, leader: _Seat) -> None:
        """Pass the teacher's changed view on; of several quick changes only the last is passed on."""
        if not self._leading and leader is self._leader():
            self._leading = True
            self._post(self._lead, leader)

    def _lead(self, leader: _Seat) -> None:
        self._leading = False
        for seat in self._present():
            if seat is not leader and seat.follows:
                _turn_as(leader.client, seat.client)

    # Controls and messages in each browser.

    def _add_teacher_folder(self, seat: _Seat) -> None:
        """Add the teacher's own controls."""
        client = seat.client
        with client.gui.add_folder("Lecture", order=-1.0):
            size_text = Gui(client.gui).add_markdown(Markdown(""))
            seat.show_size = partial(setattr, size_text, "content")
            steer = client.gui.add_checkbox(
                "The class may steer",
                self._all_steer,
                hint="Lets the students' controls change the session. Without it, students only vote and "
                "turn their own view.",
            )
            steer.on_update(lambda _: self._post(self._let_steer, steer.value))
            show = client.gui.add_button(
                "Address of the class", hint="Shows the address as text and as a QR code."
            )
            show.on_click(lambda _: self._post(self._show_address, client))

    def _show_address(self, client: viser.ClientHandle) -> None:
        with client.gui.add_modal("Join the class") as modal:
            warning = (
                Markup('<div class="warning">{}</div>').format(UNREACHED)
                if is_loopback(urlsplit(self._url).hostname or "")
                else Markup("")
            )
            shown = Markup('<div class="packetmesh-join">{}{}<p>{}</p></div>').format(
                warning, qr_html(self._url), self._url
            )
            Gui(client.gui).add_html(shown)
            client.gui.add_button("Close").on_click(lambda _: modal.close())

    def _let_steer(self, all_steer: bool) -> None:
        self._all_steer = all_steer
        for seat in self._present():
            self._show(seat)

    def _count(self) -> None:
        following = sum(seat.follows for seat in self._seats.values() if not seat.teaches)
        size = self.class_size
        sentence = Markdown("**{}** in the class, **{}** of them follow your view.").format(size, following)
        for seat in self._present():
            seat.show_size(sentence if size else Markdown("**Nobody is in the class yet.**"))

    def _add_bar(self, seat: _Seat) -> None:
        """Add the student's bar to the page, and handle the page's messages: follow, roam or vote."""
        client, name = seat.client, uuid.uuid4().hex
        ui = self._own_ui(client)
        with add_hidden(ui, name, page_call("beginSeat", name)):
            field = client.gui.add_text("Seat", "")
            html = ui.gui.add_html(Markup(""))
        marks = itertools.count()

        def call(function: str, *arguments: object) -> None:
            html.content = page_call(function, *arguments, mark=next(marks))

        def on_message() -> None:
            message = STUDENT_MESSAGE.fullmatch(field.value)
            if message is None:
                return
            follow, _, vote, voter = message.groups()
            if vote is not None:
                self._vote(seat, int(vote), voter)
                return
            seat.follows = follow is not None
            if seat.follows:
                self._catch_up(seat)
            self._show(seat)
            self._count()

        seat.call = call
        ui.when_changed(field, on_message)
        self._show(seat)

    def _own_ui(self, client: viser.ClientHandle) -> Ui:
        """Return the controls that only this browser has, next to the shared ones."""
        return Ui(Gui(client.gui), client.scene, self._post, client.atomic, client.flush)

    def _show(self, seat: _Seat) -> None:
        state = {
            "follows": seat.follows,
            "steers": self._all_steer,
            "asks": self._count_vote is not None,
            "vote": seat.vote,
        }
        seat.call("showSeat", state)

    def _vote(self, seat: _Seat, vote: int, voter: str) -> None:
        if self._count_vote is not None:
            seat.vote, seat.voter = vote, seat.voter or voter
            self._count_vote(seat.voter, vote)

    # Who may use shared controls: called on the thread of the connections.

    def _may_steer(self, number: int) -> bool:
        return self._all_steer or self._teaches(number)

    def _teaches(self, number: int) -> bool:
        return self._token.is_in(private.cookies(self._server, number))

    def _refuse(self, number: int) -> None:
        """Show a student that the control just used belongs to the teacher."""
        seat = self._seats.get(number)
        if seat is not None:
            seat.call("refuse")


def _turn_as(leader: viser.ClientHandle, client: viser.ClientHandle) -> None:
    """Turn a browser's view to the leader's view."""
    turn(client, leader.camera.look_at, leader.camera.position)
    client.camera.fov = leader.camera.fov


SIDE_PX = 360
PX_PER_MODULE = 8


def modules_of(text: str) -> ByteArray:
    """Return the text's QR code, (N, N), 0 for dark, with a quiet zone of four modules."""
    encoded = cv2.QRCodeEncoder.create().encode(text)  # has a quiet zone of two modules
    return cv2.copyMakeBorder(encoded, 2, 2, 2, 2, cv2.BORDER_CONSTANT, value=(255,))


def qr_html(text: str) -> Markup:
    """Return the text's QR code as an HTML image."""
    modules = modules_of(text)
    picture = cv2.resize(modules, None, fx=PX_PER_MODULE, fy=PX_PER_MODULE, interpolation=cv2.INTER_NEAREST)
    data = base64.b64encode(cv2.imencode(".png", picture)[1].tobytes()).decode()
    return Markup('<img alt="QR code of {}" width="{}" src="data:image/png;base64,{}">').format(
        text, SIDE_PX, data
    )

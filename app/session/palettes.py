"""The command palette of a session: its entries, which are found by typing or have keys.

Entries that change the session are offered to all its browsers; in a lecture only those that may steer can
use them. Entries that concern one browser, such as its view, are offered to each browser separately.
"""

from __future__ import annotations

import html
import re
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import viser

from app.drawing.directions import SIDES
from app.session.framing import Framing
from app.session.history import History
from app.session.looking import Looking
from app.session.picture import ViewPicture
from app.web.markup import Markup
from app.web.uploads import plain
from app.web.viser_private import contents
from app.window.in_address import STOP, InAddress
from app.window.page import page_call
from app.window.palette import KEYS, Entry, Palette
from app.window.panel import PanelSession
from app.window.tools import Tools
from app.window.ui import Ui
from packetmesh.errors import InputError
from pipeline.io.demos import DEMOS
from pipeline.sources import demo_of

REST_S = 0.5
"""Time without any computation after which new entries are collected, seconds."""
FAILED, SHOWN_S = "That did not work", 15.0
"""Title of a notification of an error, and time for which it is shown, seconds."""
LESSON_FOLDER = "Lesson: "
"""Beginning of the title of a lesson's folder, whose controls are not offered as settings."""
TERM = re.compile(r'class="packetmesh-term" data-hint="([^"]+)">([^<]+)<')
"""A word with an explanation in a screen's HTML (``app.window.tables.term``)."""


class Palettes:
    """The palettes of all browsers of a session. Methods run on the session's thread."""

    def __init__(self, session: PanelSession, framing: Framing) -> None:
        """Keep the session and its ``framing`` of views, on which the entries act."""
        self._session, self._framing = session, framing
        self._history = History(session)
        self._shared = Palette(session.ui.gui, session.post)
        self._own: list[OwnPalette] = []
        self._folders: Mapping[str, Any] = {}
        self._calls = 0
        self._resting = session.ui.debounce(REST_S, self._refresh)

    def begin(self, folders: Mapping[str, Any], tools: Tools) -> None:
        """Offer the entries, and record changes for *Undo* from now on.

        Args:
            folders: the screens' folders in the control panel, by title.
            tools: the row of buttons.
        """
        self._folders, self._tools = folders, tools
        self._history.begin()
        self._html = self._session.ui.gui.add_html(Markup(""))
        self._shared.offer(self._entries())

    def add(
        self, ui: Ui, client: viser.ClientHandle, on_turned: Callable[[], None] = lambda: None
    ) -> Callable[[], None]:
        """Offer a browser its own entries. Returns the function that is called when it has left."""
        ui = replace(ui, post=partial(self._session.post, _run_for, client))
        own = OwnPalette(ui, client, Looking(client, self._framing, on_turned), self._file_name)
        self._own.append(own)
        own.offer({})
        return partial(self._own.remove, own)

    def follow(self, by_hand: bool) -> None:
        """Record a possible change of the settings, by a user (``by_hand``) or by a result."""
        self._history.follow(by_hand)
        if self._folders:
            self._tools.show(*self._history.has_steps)

    def accept(self) -> None:
        """Take the present settings as they are: they cannot be undone."""
        self._history.accept()

    def rest(self) -> None:
        """Collect new entries after ``REST_S``; called when everything is computed."""
        self._resting.restart()

    def _refresh(self) -> None:
        """Also offer the controls and the terms in tables that the screens have by now."""
        inside = {title: list(contents(folder)) for title, folder in self._folders.items()}
        settings = [entry for title in inside for entry in self._settings(title, inside[title])]
        self._shared.offer([*self._entries(), *settings])
        terms = dict[tuple[str, str], str]()
        for title, found in inside.items():
            for handle, _ in found:
                for hint, name in TERM.findall(getattr(handle, "content", None) or ""):
                    terms.setdefault((html.unescape(name), html.unescape(hint)), title)
        for own in self._own:
            own.offer(terms)

    def _entries(self) -> Iterator[Entry]:
        """Yield the entries that are always there."""
        session, history = self._session, self._history
        yield Entry("Undo", "Settings", lambda: self._say(history.undo()), KEYS["undo"])
        yield Entry("Redo", "Settings", lambda: self._say(history.redo()), KEYS["redo"])
        for panel in session.panels:
            yield Entry(panel.title, "Screen", partial(session.show, panel.title))
        for panel in session.panels:
            for key, part in panel.in_address.items():
                lesson = getattr(part, "lesson", None)
                if key.startswith(STOP) and lesson is not None:
                    begin = partial(self._learn, panel.title, part, lesson.scene)
                    yield Entry(lesson.title, f"Lesson on {panel.title}", begin)
        for name, scene in DEMOS.items():
            yield Entry(scene.title, "Scene", partial(self._open_scene, name))

    def _settings(self, screen: str, inside: Iterable[tuple[Any, tuple[str, ...]]]) -> Iterator[Entry]:
        """Yield an entry for each control and folder of a screen; choosing the entry points at the control.

        An entry names folders only if its label was used before, because the palette searches this text too.
        """
        labels = set[str]()
        for handle, titles in inside:
            label = getattr(handle, "label", None)
            if (
                isinstance(handle, viser.GuiImageHandle)
                or not label
                or any(title.startswith(LESSON_FOLDER) for title in (label, *titles))
            ):
                continue
            is_folder = isinstance(handle, viser.GuiFolderHandle)
            kind = "Part of" if is_folder else "Setting on"
            place = " › ".join((screen, *titles)) if label in labels else screen
            labels.add(label)
            opens = (*titles, label) if is_folder else titles
            yield Entry(
                label, f"{kind} {place}", partial(self._point, screen, opens, handle._impl.uuid, label)
            )

    def _open_scene(self, name: str) -> None:
        self._session.want(replace(self._session.spec, source=demo_of(name)))

    def _learn(self, screen: str, part: InAddress, scene: str) -> None:
        """Begin a lesson in its scene."""
        if scene:
            self._open_scene(scene)
        self._session.show(screen)
        part.take("1")

    def _point(self, screen: str, opens: tuple[str, ...], name: str, label: str) -> None:
        """Show a screen, open these folders and point at a control."""
        if self._session.current.title != screen:
            self._session.show(screen)
        self._call("point", list(opens), name, label)

    def _say(self, sentence: str) -> None:
        self._call("say", sentence)

    def _call(self, function: str, *arguments: object) -> None:
        self._calls += 1
        self._html.content = page_call(function, *arguments, mark=self._calls)

    def _file_name(self) -> str:
        """Return the name of a picture of what is shown, without its suffix."""
        source = re.sub(r"[^\w-]+", "-", self._session.spec.source.title.rpartition("/")[2]).strip("-")
        return f"packetmesh-{source}-{self._session.current.title.lower()}"


class OwnPalette:
    """The entries that concern one browser: its view, a picture of it, and explanations."""

    def __init__(
        self, ui: Ui, client: viser.ClientHandle, looking: Looking, file_name: Callable[[], str]
    ) -> None:
        self._looking = looking
        self._palette = Palette(ui.gui, ui.post)
        self._picture = ViewPicture(ui, client, uuid.uuid4().hex, file_name)
        self._html = ui.gui.add_html(Markup(""))
        self._calls = 0

    def offer(self, terms: Mapping[tuple[str, str], str]) -> None:
        """Offer the views of what is drawn now, and ``terms``: the screen by name and explanation."""
        self._palette.offer([*self._entries(), *self._terms(terms)])

    def _entries(self) -> Iterator[Entry]:
        looking = self._looking
        for side in SIDES:
            label = "View from above" if side == "above" else f"View from the {side}"
            yield Entry(label, "View", partial(looking.look, side), KEYS[side])
        yield Entry("View from the next camera node", "View", self._look_from_next, KEYS["node"])
        yield Entry("View as opened", "View", looking.look_as_opened, KEYS["opened"])
        yield Entry("Fit the view to the window", "View", looking.fit, KEYS["fit"])
        yield Entry(
            "Full screen: only the 3-D picture", "View", partial(self._call, "standAlone"), KEYS["alone"]
        )
        yield Entry(
            "Picture of the view, at twice its size", "View, PNG file", self._picture.take, KEYS["picture"]
        )
        for node in looking.nodes:
            yield Entry(f"View from {node.name}", "View", partial(looking.look_from, node.name))

    def _terms(self, terms: Mapping[tuple[str, str], str]) -> Iterator[Entry]:
        for (name, hint), screen in terms.items():
            yield Entry(name, f"Term on {screen}: what it means", partial(self._call, "define", name, hint))

    def _look_from_next(self) -> None:
        self._call("say", f"View from {self._looking.look_from_next()}.")

    def _call(self, function: str, *arguments: object) -> None:
        self._calls += 1
        self._html.content = page_call(function, *arguments, mark=self._calls)


def _run_for(client: viser.ClientHandle, function: Callable[..., object], *arguments: object) -> None:
    """Run a function for one browser, which alone is notified of an ``InputError``."""
    try:
        function(*arguments)
    except InputError as error:
        client.add_notification(FAILED, plain(str(error)), color="red", auto_close_seconds=SHOWN_S)

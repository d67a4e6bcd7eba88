"""Keep a session's addresses equal to its state, and apply the addresses that browsers open."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import viser

from app.compute.state import Spec
from app.session.address import Address, Place
from app.session.views import Views
from app.window.in_address import STOP, InAddress
from app.window.panel import PanelSession
from app.window.ui import Ui
from packetmesh.errors import InputError

CAMERA = "cam"
REST_S = 0.3
"""Time that the view must be still before the address is updated, seconds."""


class Places:
    """The addresses of a session: of its one browser, or of the teachers' browsers in a lecture."""

    def __init__(
        self, session: PanelSession, views: Views | None, on_opened: Callable[[], None] = lambda: None
    ) -> None:
        """Keep the addresses of a session.

        Args:
            session: the session.
            views: its views; None if many browsers share the session.
            on_opened: called once, when the first address has been applied.
        """
        self._session, self._views, self._on_opened = session, views, on_opened
        self._opened = False
        self._start = self._now()
        self._addresses: list[Address] = []
        if isinstance(session.target, viser.ClientHandle):
            rest = session.ui.debounce(REST_S, self.follow)
            session.target.camera.on_update(lambda _: rest.restart())

    def add(self, ui: Ui) -> Callable[[], None]:
        """Connect a browser's address to the session. Returns the function that disconnects it."""
        session = self._session
        titles = [panel.title for panel in session.panels]
        keys = dict.fromkeys(
            key for panel in session.panels for key in (*panel.in_address, *panel.always_in_address)
        )
        address = Address(ui, session.uploads, self._start, titles, (*keys, CAMERA), self._go_to)
        self._addresses.append(address)
        address.show(self._now())

        def remove() -> None:
            self._addresses.remove(address)
            address.close()

        return remove

    def reset(self) -> None:
        """Restore the screens and the settings to their state at the start."""
        session = self._session
        for reset in session.ui.resets:
            reset()
        for panel in session.panels:
            for part in (*panel.in_address.values(), *panel.always_in_address.values()):
                if part.place():
                    part.take("")
        session.want(self._start.spec)

    def follow(self) -> None:
        """Update the addresses after a possible change."""
        if self._addresses:
            place = self._now()
            for address in self._addresses:
                address.show(place)

    def _now(self) -> Place:
        session = self._session
        texts = {key: part.place() for key, part in self._parts().items()}
        added = tuple((key, text) for key, text in texts.items() if text)
        return Place(session.spec, session.current.title, added)

    def _parts(self) -> dict[str, InAddress]:
        """Return the parts that appear in the address now, by their keys."""
        session = self._session
        parts = dict[str, InAddress]()
        for panel in session.panels:
            parts |= panel.always_in_address
            if panel.drawn_below == session.current.drawn_below:
                parts |= panel.in_address
        return parts if self._views is None else parts | {CAMERA: self._views}

    def _go_to(self, place: Place, wrong: list[str]) -> None:
        """Show the place of an address, and report the address's wrong parts in one notification."""
        session = self._session
        session.want(_with(session.spec, place.spec))
        if place.screen != session.current.title:
            session.show(place.screen)
        wrong += self._take(dict(place.added), place.spec)
        if wrong:
            more = f" (and {len(wrong) - 1} more)" if len(wrong) > 1 else ""
            session.notify("Part of the address was ignored", f"{wrong[0].rstrip('.')}{more}.")
        if not self._opened:
            self._opened = True
            self._on_opened()

    def _take(self, added: Mapping[str, str], spec: Spec) -> list[str]:
        """Apply lesson stops first, then the parts that differ from them. Returns the error sentences."""
        session, wrong = self._session, list[str]()
        parts = self._parts()
        stops = sorted((key for key in parts if key.startswith(STOP)), key=lambda key: key in added)
        stopped = any(key in added for key in stops)
        others = [key for key in parts if key not in stops and (key in added or not stopped)]
        for keys in (stops, others):
            for key in keys:
                try:
                    if parts[key].place() != added.get(key, ""):
                        parts[key].take(added.get(key, ""))
                except InputError as error:
                    wrong.append(str(error))
            if keys is stops and spec.config != self._start.spec.config:
                session.want(_with(session.spec, spec))
        return wrong


def _with(spec: Spec, other: Spec) -> Spec:
    """Return ``spec`` with the source, preset and settings of ``other``."""
    return replace(spec, source=other.source, preset=other.preset, config=other.config)

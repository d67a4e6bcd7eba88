"""The page's address as the state of the app: scene, preset, changed settings, screen, and a screen's own
parts, such as the stop of a lesson, the time of a clock or the camera's pose.

``?scene=office&preset=thesis&set=depth.reach%3D0.2&stop=2&screen=surface``; what the address does not name
keeps the server's start value. The page's part is ``address.js``.
"""

from __future__ import annotations

import uuid
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from urllib.parse import parse_qsl, urlencode

from app.compute.state import Spec
from app.web.markup import Markup
from app.web.uploads import GONE, PREFIX, Uploads, name_in
from app.window.hidden import add_hidden
from app.window.in_address import STOP
from app.window.page import page_call
from app.window.ui import Ui
from packetmesh.errors import InputError
from packetmesh.settings import differences, key_of, with_settings
from pipeline.config import PRESETS, PipelineConfig
from pipeline.io.demos import DEMOS
from pipeline.sources import Source, demo_of

WAIT_S = 0.3
"""Delay between a change and the update of the address, seconds."""
FILES = {"depth.model", "depth.completion"}
"""Settings that name a file of the server: an address must not set them."""


@dataclass(frozen=True, slots=True)
class Place:
    """The state that an address describes."""

    spec: Spec
    screen: str
    """Title of the screen."""
    added: tuple[tuple[str, str], ...] = ()
    """Keys and values of the parts of the screen."""

    def text(self) -> str:
        """Return the query of the address."""
        spec = self.spec
        parts = [("scene", name_of(spec.source)), ("preset", spec.preset)]
        changed = differences(spec.config, PRESETS.get(spec.preset, PipelineConfig()))
        parts += [("set", change) for change in changed if key_of(change) not in FILES]
        return urlencode([*parts, *self.added, ("screen", self.screen.lower())])

    def is_apart(self, other: Place) -> bool:
        """Whether this place and ``other`` get separate entries in the browser's history."""
        places = [(one.screen, one.spec.source, one.stops) for one in (self, other)]
        return places[0] != places[1]

    @property
    def stops(self) -> dict[str, str]:
        """Return the stops of lessons by their keys."""
        return {key: value for key, value in self.added if key.startswith(STOP)}


def name_of(source: Source) -> str:
    """Return the name of a source in an address: a demo, an upload, a file or a folder."""
    return name_in(source) or Path(source.title).name


def place_of(
    text: str,
    start: Place,
    screens: Sequence[str],
    sources: Mapping[str, Source],
    keys: Sequence[str] = (),
) -> tuple[Place, list[str]]:
    """Parse an address. Returns the place and one error sentence for each part that cannot be used.

    Args:
        text: the query.
        start: the place whose values hold where the query gives none.
        screens: titles of the screens.
        sources: sources by their names.
        keys: keys that the screens add.
    """
    named, changes, wrong = dict[str, str](), list[str](), list[str]()
    for key, value in parse_qsl(text, keep_blank_values=True):
        if key == "set":
            changes.append(value)
        else:
            named[key] = value
    spec, titles = start.spec, {title.lower(): title for title in screens}
    known = {"scene": sources, "preset": PRESETS, "screen": titles}
    for key in [key for key in known if key in named and named[key] not in known[key]]:
        value = named.pop(key)[:40]
        gone = key == "scene" and value.startswith(PREFIX)
        wrong.append(GONE if gone else f"The address has {key}={value}; try one of {', '.join(known[key])}")
    if "scene" in named:
        spec = replace(spec, source=sources[named["scene"]])
    if "preset" in named:
        spec = spec.with_preset(named["preset"])
    for change in changes:
        try:
            if key_of(change) in FILES:
                raise InputError("The address names a file of the server; choose a network under Depth")
            spec = replace(spec, config=with_settings(spec.config, [change]))
        except InputError as error:
            wrong.append(str(error))
    added = tuple((key, named[key]) for key in keys if key in named)
    return Place(spec, titles.get(named.get("screen", ""), start.screen), added), wrong


class Address:
    """Receives the page's new addresses, and keeps the page's address equal to the session's state."""

    def __init__(
        self,
        ui: Ui,
        uploads: Uploads,
        start: Place,
        screens: Sequence[str],
        keys: Sequence[str],
        on_place: Callable[[Place, list[str]], None],
    ) -> None:
        """Add the hidden controls to the page.

        Args:
            ui: panel of the browser.
            uploads: uploads of the server.
            start: the place of an empty address.
            screens: titles of the screens.
            keys: keys that the screens add.
            on_place: called with the place of a new address and the error sentences of its wrong parts.
        """
        self._uploads, self._start, self._on_place = uploads, start, on_place
        self._screens, self._keys = screens, keys
        self._sources: dict[str, Source] = {name: demo_of(name) for name in DEMOS}
        self._sources[name_of(start.spec.source)] = start.spec.source
        self._place = start
        self._text = ""
        self._count = 0
        name = uuid.uuid4().hex
        own = ["scene", "preset", "set", "screen", *keys]
        with add_hidden(ui, name, page_call("beginAddress", name, own, start.text())):
            self._field = ui.when_changed(ui.gui.add_text("Address", ""), self._on_message)
            self._message = ui.gui.add_html(Markup(""))
        self._timer = ui.debounce(WAIT_S, self._send)

    def show(self, place: Place) -> None:
        """Set the address to this place after a pause, and not before the page has sent its first address."""
        if place == self._place:
            return
        self._place = place
        if self._text and not self._timer.pending:
            self._timer.restart()

    def close(self) -> None:
        """Stop updating the address: the browser is gone."""
        self._timer.cancel()

    def _on_message(self) -> None:
        text = self._field.value.partition(" ")[2]
        begins, self._text = not self._text, text or " "
        try:
            if (text or not begins) and text != self._place.text():
                self._on_place(*self._read(text))
        finally:  # replaces the parts that could not be used
            self._timer.restart()

    def _read(self, text: str) -> tuple[Place, list[str]]:
        scene = dict(parse_qsl(text)).get("scene", "")
        upload = self._uploads.find(scene)
        sources = self._sources if upload is None else self._sources | {scene: upload}
        return place_of(text, self._start, self._screens, sources, self._keys)

    def _send(self) -> None:
        """Send the page its address, even one that the page requested: the state may have changed since."""
        place, text = self._place, self._place.text()
        before, wrong = self._read(self._text)
        new = not wrong and place.is_apart(before)
        self._text = text
        self._count += 1
        self._message.content = page_call("showAddress", text, new, mark=self._count)

"""The address of the page as the state of the app: scene, preset, settings that differ, screen, and what the
screen adds of its own, such as the stop of a lesson, the moment of a clock or where a person stands.

``?scene=office&preset=thesis&set=depth.reach%3D0.2&stop=2&screen=surface``; what is not named is as the
server started. The page's side is ``address.js``.
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
from pipeline.io.demos import DEMO_SCENES
from pipeline.sources import Demo, Source

WAIT_S = 0.3
"""After a change, before the address follows."""
FILES = {"depth.model"}
"""Settings that name a file, which an address may not."""


@dataclass(frozen=True, slots=True)
class Place:
    """What an address names."""

    spec: Spec
    screen: str
    """Its title."""
    added: tuple[tuple[str, str], ...] = ()
    """What the screen adds: keys, and what they say."""

    def text(self) -> str:
        """The query."""
        spec = self.spec
        parts = [("scene", name_of(spec.source)), ("preset", spec.preset)]
        changed = differences(spec.config, PRESETS.get(spec.preset, PipelineConfig()))
        parts += [("set", change) for change in changed if key_of(change) not in FILES]
        return urlencode([*parts, *self.added, ("screen", self.screen.lower())])

    def is_beside(self, other: Place) -> bool:
        """Whether Back is to lead from the one to the other."""
        places = [(one.screen, one.spec.source, one.stops) for one in (self, other)]
        return places[0] != places[1]

    @property
    def stops(self) -> dict[str, str]:
        """The stops of lessons, by their keys."""
        return {key: value for key, value in self.added if key.startswith(STOP)}


def name_of(source: Source) -> str:
    """What a source is called in an address: the name of a demo, an upload, a file or a folder."""
    return name_in(source) or Path(source.title).name


def place_of(
    text: str,
    start: Place,
    screens: Sequence[str],
    sources: Mapping[str, Source],
    keys: Sequence[str] = (),
) -> tuple[Place, list[str]]:
    """What an address asks for, and a sentence for everything in it that cannot be followed.

    Args:
        text: the query.
        start: what holds where it says nothing.
        screens: titles.
        sources: by their names.
        keys: what screens add.
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
    """Hears what the page's address asks for, and has it follow what is shown."""

    def __init__(
        self,
        ui: Ui,
        uploads: Uploads,
        start: Place,
        screens: Sequence[str],
        keys: Sequence[str],
        on_ask: Callable[[Place, list[str]], None],
    ) -> None:
        """Add the hidden parts.

        Args:
            ui: of the browser.
            uploads: of the server.
            start: what is shown where the address says nothing.
            screens: titles.
            keys: what screens add.
            on_ask: called with what an address asks for, and why some of it cannot be followed.
        """
        self._uploads, self._start, self._on_ask = uploads, start, on_ask
        self._screens, self._keys = screens, keys
        self._sources: dict[str, Source] = {name: Demo(name) for name in DEMO_SCENES}
        self._sources[name_of(start.spec.source)] = start.spec.source
        self._place = start
        self._text = ""
        self._count = 0
        name = uuid.uuid4().hex
        own = ["scene", "preset", "set", "screen", *keys]
        with add_hidden(ui, name, page_call("beginAddress", name, own)):
            self._field = ui.when_changed(ui.gui.add_text("Address", ""), self._hear)
            self._saying = ui.gui.add_html(Markup(""))
        self._timer = ui.debounce(WAIT_S, self._say)

    def show(self, place: Place) -> None:
        """Have the address follow, once the page has said what it asks for itself."""
        if place == self._place:
            return
        self._place = place
        if self._text and not self._timer.pending:
            self._timer.restart()

    def close(self) -> None:
        """Say nothing more: the browser is gone."""
        self._timer.cancel()

    def _hear(self) -> None:
        text = self._field.value.partition(" ")[2]
        begins, self._text = not self._text, text or " "
        try:
            if (text or not begins) and text != self._place.text():
                self._on_ask(*self._read(text))
        finally:  # what could not be followed is replaced
            self._timer.restart()

    def _read(self, text: str) -> tuple[Place, list[str]]:
        asked = dict(parse_qsl(text)).get("scene", "")
        upload = self._uploads.find(asked)
        sources = self._sources if upload is None else self._sources | {asked: upload}
        return place_of(text, self._start, self._screens, sources, self._keys)

    def _say(self) -> None:
        """Tell the page what its address should be, also if it asked for just that: it may have heard of
        another place since."""
        place, text = self._place, self._place.text()
        before, wrong = self._read(self._text)
        new = not wrong and place.is_beside(before)
        self._text = text
        self._count += 1
        self._saying.content = page_call("showAddress", text, new, mark=self._count)

"""The address of the page as the state of the app: scene, preset, settings that differ, surface and screen.

``?scene=office&preset=thesis&set=depth.reach%3D0.2&screen=surface``; what is not named is as the server
started. The page's side is ``address.js``.
"""

from __future__ import annotations

import json
import uuid
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast, get_args
from urllib.parse import parse_qsl, urlencode

from app.dock_row import add_hidden
from app.page import running
from app.records import Shown
from app.state import Spec
from app.ui import Ui
from packetmesh.errors import InputError
from packetmesh.settings import differences, key_of, with_settings
from pipeline.config import PRESETS, PipelineConfig
from pipeline.io.demos import DEMO_SCENES
from pipeline.sources import Demo, Source

WAIT_S = 0.3
"""After a change, before the address follows."""
FILES = {"depth.model"}
"""Settings that name a file, which an address may not."""
_SCRIPT = Path(__file__).with_suffix(".js").read_text(encoding="utf-8")


@dataclass(frozen=True, slots=True)
class Place:
    """What an address names."""

    spec: Spec
    screen: str
    """Its title."""

    def text(self) -> str:
        """The query."""
        spec = self.spec
        parts = [("scene", name_of(spec.source)), ("preset", spec.preset)]
        changed = differences(spec.config, PRESETS.get(spec.preset, PipelineConfig()))
        parts += [("set", change) for change in changed if key_of(change) not in FILES]
        if spec.shown != "after":
            parts.append(("surface", spec.shown))
        return urlencode([*parts, ("screen", self.screen.lower())])


def name_of(source: Source) -> str:
    """What a source is called in an address: a demo's name, or that of a file or folder."""
    return Path(source.title).name


def place_of(text: str, start: Place, screens: tuple[str, ...], sources: Mapping[str, Source]) -> Place:
    """What an address asks for.

    Args:
        text: the query.
        start: what holds where it says nothing.
        screens: titles.
        sources: by their names.

    Raises:
        InputError: something in it is not known.
    """
    named, changes = dict[str, str](), list[str]()
    for key, value in parse_qsl(text, keep_blank_values=True):
        if key == "set":
            changes.append(value)
        else:
            named[key] = value
    spec, titles = start.spec, {title.lower(): title for title in screens}
    known = {"scene": sources, "preset": PRESETS, "surface": get_args(Shown), "screen": titles}
    for key in known.keys() & named.keys():
        if named[key] not in known[key]:
            raise InputError(f"The address has {key}={named[key][:40]}; try one of {', '.join(known[key])}")
    if "scene" in named:
        spec = replace(spec, source=sources[named["scene"]])
    if "preset" in named:
        spec = spec.with_preset(named["preset"])
    if any(key_of(change) in FILES for change in changes):
        raise InputError("The address names a file of the server; choose a network on the Depth screen")
    config = with_settings(spec.config, changes)
    spec = replace(spec, config=config, shown=cast(Shown, named.get("surface", spec.shown)))
    return Place(spec, titles.get(named.get("screen", ""), start.screen))


class Address:
    """Hears what the page's address asks for, and has it follow what is shown."""

    def __init__(
        self, ui: Ui, start: Place, screens: tuple[str, ...], on_ask: Callable[[Place], None]
    ) -> None:
        """Add the hidden parts.

        Args:
            ui: of the browser.
            start: what is shown where the address says nothing.
            screens: titles.
            on_ask: called with what an address asks for.
        """
        self._start, self._screens, self._on_ask = start, screens, on_ask
        self._sources: dict[str, Source] = {name: Demo(name) for name in DEMO_SCENES}
        self._sources[name_of(start.spec.source)] = start.spec.source
        self._place = start
        self._text = ""
        self._count = 0
        name = uuid.uuid4().hex
        begin = f"; window.packetmeshAddress.begin({json.dumps(name)})"
        with add_hidden(ui, name, _SCRIPT + begin):
            self._field = ui.when_changed(ui.gui.add_text("Address", ""), self._hear)
            self._saying = ui.gui.add_html("")
        self._timer = ui.debounce(WAIT_S, self._say)

    def show(self, place: Place) -> None:
        """Have the address follow, once the page has said what it asks for itself."""
        self._place = place
        self._sources[name_of(place.spec.source)] = place.spec.source
        if self._text and place.text() != self._text:
            self._timer.restart()

    def _hear(self) -> None:
        text = self._field.value.partition(" ")[2]
        begins, self._text = not self._text, text or " "
        try:
            if text or not begins:
                self._on_ask(self._read(text))
        finally:  # what could not be followed is replaced
            self.show(self._place)

    def _read(self, text: str) -> Place:
        return place_of(text, self._start, self._screens, self._sources)

    def _say(self) -> None:
        text, now = self._place.text(), self._place
        try:
            before = self._read(self._text)
            new = (before.screen, before.spec.source) != (now.screen, now.spec.source)
        except InputError:
            new = False
        self._text = text
        self._count += 1
        script = f"window.packetmeshAddress?.show({json.dumps(text)}, {json.dumps(new)})"
        self._saying.content = running(script, self._count)

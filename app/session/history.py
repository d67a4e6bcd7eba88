"""Undo and redo of a session's settings: source, preset, settings of the chain, and what the screens set.

A state is the content of the address without the parts that are no settings, such as the camera's pose or
the time of a clock. Undo requests the earlier state as an address does: only what differs is computed, and
earlier results are still in the store.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

from app.compute.state import Spec
from app.window.in_address import STOP, InAddress
from app.window.panel import PanelSession
from packetmesh.errors import InputError
from packetmesh.settings import differences, key_of
from pipeline.config import PipelineConfig
from pipeline.sources import Source

NO_SETTINGS = {"t", "node", "photo", "pictures", "ball", "measure"}
"""Keys of the address that are not undone: places in a result, and measures, which have their own list."""
LOOK = "look"
"""Key of the folder *Look*, whose text holds several settings (``app.looking.look``)."""
SAME_S = 1.5
"""Changes of one setting within this time, seconds, are one step, as when a slider is dragged."""
MOST_STEPS = 100
NAMES: Mapping[str, str] = {
    "source": "scene",
    "preset": "preset",
    "surface.radii_m": "radius",
    "surface.radius_rule": "radii",
    "recording.frames": "frames",
    "depth.model": "depth network",
    "depth.completion": "completion network",
    "color": "colours",
    "surface": "surface shown",
    "show": "what Fuse shows",
    "race": "race",
    "net": "network",
    "lang": "language",
    STOP: "stop of the lesson",
    "look.top": "Cut away",
    "look.plane": "Cut away",
    "look.box": "Cut away",
    "look.out": "Cut away",
    "look.wire": "Draw",
    "look.light": "Draw",
    "look.points": "Points",
    "look.ruler": "Scale bar and axes",
}
"""Names of the parts of a state that have no control of their own; others are named by their field."""
RESET = "Reset"


@dataclass(frozen=True, slots=True)
class Settings:
    """The state that is undone and redone."""

    source: Source
    preset: str
    config: PipelineConfig
    parts: tuple[tuple[str, str, str], ...]
    """Screen, key and text of the parts of the screens that are settings and not in their start state."""

    def names_of_changes(self, before: Settings) -> tuple[str, ...]:
        """Return the names of the settings that differ from ``before``.

        The chain's settings are named only if scene and preset are the same.
        """
        named = ["source"] if self.source != before.source else []
        named += ["preset"] if self.preset != before.preset else []
        if not named:
            named += [key_of(change) for change in differences(self.config, before.config)]
        named += sorted(set(self._changed_parts(before)))
        names = (NAMES[STOP] if key.startswith(STOP) else NAMES.get(key, _words(key)) for key in named)
        return tuple(dict.fromkeys(names))

    def _changed_parts(self, before: Settings) -> Iterator[str]:
        """Yield the keys of the parts that differ, of *Look* with the kind of setting (``look.wire``)."""
        texts, others = ({part[:2]: part[2] for part in one.parts} for one in (self, before))
        for name in texts.keys() | others.keys():
            text, other = texts.get(name, ""), others.get(name, "")
            if text == other:
                continue
            if name[1] != LOOK:
                yield name[1]
                continue
            for setting in filter(None, {*text.split("~")} ^ {*other.split("~")}):
                yield f"{LOOK}.{setting.partition('_')[0]}"


@dataclass(slots=True)
class _Step:
    """A change by the user."""

    before: Settings
    after: Settings
    name: str
    keys: tuple[str, ...]
    made_s: float


class History:
    """The steps of one session. Methods run on the session's thread."""

    def __init__(self, session: PanelSession, clock: Callable[[], float] = time.monotonic) -> None:
        self._session, self._clock = session, clock
        self._undone: list[_Step] = []
        self._steps: list[_Step] = []
        self._now: Settings | None = None
        self._first: Settings | None = None

    def begin(self) -> None:
        """Remember the present state as the one that *Reset* restores. Called once the screens are built."""
        self._first = self._now = self._read()

    def accept(self) -> None:
        """Take the present state without recording a step, because a link has opened it.

        After a step of the user it was not opened: the browser's *Back* is a step like others.
        """
        if not any(self.has_steps):
            self._now = self._read()

    def follow(self, by_hand: bool) -> None:
        """Record a step if a user has changed the settings (``by_hand``); a result's change is no step."""
        if self._now is None:
            return
        before, now = self._now, self._read()
        if now == before:
            return
        self._now = now
        if by_hand:
            self._note(before, now)

    def undo(self) -> str:
        """Go back by one step. Returns a sentence about it."""
        if not self._steps:
            return "There is nothing to undo."
        step = self._steps.pop()
        self._undone.append(step)
        self._restore(step.before)
        return f"Undone: {step.name}."

    def redo(self) -> str:
        """Go forward again by one step. Returns a sentence about it."""
        if not self._undone:
            return "There is nothing to redo."
        step = self._undone.pop()
        self._steps.append(step)
        self._restore(step.after)
        return f"Redone: {step.name}."

    @property
    def has_steps(self) -> tuple[bool, bool]:
        """Return whether there is something to undo, and something to redo."""
        return bool(self._steps), bool(self._undone)

    def _note(self, before: Settings, now: Settings) -> None:
        keys, now_s = now.names_of_changes(before), self._clock()
        self._undone.clear()
        last = self._steps[-1] if self._steps else None
        if last is not None and last.keys == keys and now_s - last.made_s < SAME_S:
            last.after, last.made_s = now, now_s
            if last.before == now:
                self._steps.pop()
            return
        more = f" and {len(keys) - 1} more" if len(keys) > 1 else ""
        name = RESET if now == self._first and more else keys[0] + more
        self._steps.append(_Step(before, now, name, keys, now_s))
        del self._steps[:-MOST_STEPS]

    def _read(self) -> Settings:
        spec = self._session.spec
        parts = ((title, key, part.place()) for (title, key), part in self._parts().items())
        return Settings(spec.source, spec.preset, spec.config, tuple(part for part in parts if part[2]))

    def _parts(self) -> dict[tuple[str, str], InAddress]:
        """Return the parts of all screens that are settings, by screen and key."""
        return {
            (panel.title, key): part
            for panel in self._session.panels
            for key, part in panel.in_address.items()
            if key not in NO_SETTINGS
        }

    def _restore(self, settings: Settings) -> None:
        """Request the state of another step: stops of lessons first, because they set other parts."""
        session, texts = self._session, {part[:2]: part[2] for part in settings.parts}
        session.want(_with(session.spec, settings))
        parts = self._parts()
        for name in sorted(parts, key=lambda name: not name[1].startswith(STOP)):
            text = texts.get(name, "")
            if parts[name].place() != text:
                try:
                    parts[name].take(text)
                except InputError as error:  # such as a choice that its scene alone has
                    session.notify("Part of the change could not be restored", str(error))
        session.want(_with(session.spec, settings))
        self._now = self._read()


def _with(spec: Spec, settings: Settings) -> Spec:
    return replace(spec, source=settings.source, preset=settings.preset, config=settings.config)


def _words(key: str) -> str:
    """Return the last name of a dotted key as words, without the unit ``_m``."""
    return key.rpartition(".")[2].removesuffix("_m").replace("_", " ")

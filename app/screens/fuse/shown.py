"""The choice of what the Fuse screen shows: the walk of a recording, a race, or the nodes."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from app.screens.fuse.labels import BEFORE, RACE_NAMES, RACES, RESULT, WALK
from app.screens.fuse.view import RaceMode
from app.window.in_address import tell_unknown
from app.window.ui import Ui
from packetmesh.errors import InputError

if TYPE_CHECKING:
    import viser

RACE = "race"
NAMES = {"walk": WALK, "result": RESULT, "before": BEFORE}
"""Labels by the names used in the address, besides ``RACE`` for any race."""


class ShownChoice:
    """A drop-down, and the groups of controls that are visible with the walk only, or without it only.

    Its first entry is the start value, which depends on the scene.
    """

    def __init__(self, ui: Ui, on_change: Callable[[], object]) -> None:
        """Start without controls; ``on_change`` is called when another entry is chosen."""
        self._ui, self._on_change = ui, on_change
        self._groups: list[tuple[viser.GuiFolderHandle, bool]] = []
        self._known, self._requested = False, ""
        """Whether the scene is known, and the name from the address that is kept until then."""

    def add(self) -> None:
        """Add the drop-down."""
        self._handle = self._ui.gui.add_dropdown(
            "Show", [*RACES, RESULT, BEFORE], hint="Contents of the 3-D view."
        )
        self._ui.when_changed(self._handle, self._picked)

    def group(self, walk: bool) -> viser.GuiFolderHandle:
        """Return a container that is shown with the walk only, or without it only."""
        folder: viser.GuiFolderHandle = self._ui.gui.add_folder(None, visible=not walk)
        self._groups.append((folder, walk))
        return folder

    @property
    def walking(self) -> bool:
        """Whether the walk is chosen."""
        return self._handle.value == WALK

    @property
    def before(self) -> bool:
        """Whether the nodes before registration are chosen."""
        return self._handle.value == BEFORE

    @property
    def mode(self) -> RaceMode | None:
        """The mode of the chosen race; None if no race is chosen."""
        return RACES.get(self._handle.value)

    @property
    def races(self) -> tuple[RaceMode, ...]:
        """The modes of the races that are offered."""
        return tuple(RACES[name] for name in self._handle.options if name in RACES)

    def expect(self, walk: bool) -> None:
        """Offer the entries that a scene probably has while it is loaded; ``offer`` follows afterwards."""
        self._known = False
        if walk != (WALK in self._handle.options):
            self._offer(single=False, walk=walk)

    def offer(self, single: bool, walk: bool) -> None:
        """Offer the entries that a scene has, and choose the one that the address names.

        Args:
            single: whether the scene has one node, so that no two nodes can race.
            walk: whether it is a recording: it has a walk, but no poses before registration.
        """
        self._offer(single, walk)
        requested, self._requested, self._known = self._requested, "", True
        if requested and self._label(requested) in self._handle.options:
            self.take(requested)
        elif requested:
            self._ui.post(self.take, requested)  # it says that there is no such entry

    def _offer(self, single: bool, walk: bool) -> None:
        races = [name for name, mode in RACES.items() if mode != "nodes" or not single]
        options = (WALK, *races, RESULT) if walk else (*races, RESULT, BEFORE)
        if self._handle.options != options:
            self._handle.options = options
            self._choose(options[0])

    def _choose(self, label: str) -> None:
        self._handle.value = label
        self._arrange()

    def _arrange(self) -> None:
        for folder, walk in self._groups:
            folder.visible = walk == self.walking

    def restart(self) -> None:
        """Choose the start value."""
        self._choose(self._handle.options[0])

    def race(self, mode: RaceMode) -> None:
        """Choose a race."""
        self._choose(RACE_NAMES[mode])

    def walk(self) -> None:
        """Choose the walk; while the scene is loading, as soon as it is known.

        Raises:
            InputError: the scene is no recording.
        """
        if WALK in self._handle.options:
            self._choose(WALK)
        elif self._known:
            raise InputError("In this scene no camera walks; choose a recording under Scene")
        else:
            self._requested = "walk"

    def place(self) -> str:
        """Return the name of the choice; empty for the start value, and for a race if races come first."""
        if self._requested:
            return self._requested
        if self._handle.value == self._handle.options[0]:
            return ""
        if self.mode is not None:
            return RACE if self._handle.options[0] == WALK else ""
        return next(name for name, label in NAMES.items() if label == self._handle.value)

    def take(self, place: str) -> None:
        """Choose by name, at once or as soon as the scene is known.

        Raises:
            InputError: there is no such entry.
        """
        options = self._handle.options
        if not self._known:
            self._requested = place
            return
        label = self._label(place)
        if label is None or label not in options:
            tell_unknown(place, [name for name in (RACE, *NAMES) if self._label(name) in options])
        elif self._handle.value != label and not (place == RACE and self.mode is not None):
            self._choose(label)
            self._on_change()

    def _label(self, place: str) -> str | None:
        """Return the entry of a name in the address; None if no scene has one of that name."""
        options = self._handle.options
        race = next(label for label in options if label in RACES)
        return {"": options[0], RACE: race, **NAMES}.get(place)

    def _picked(self) -> None:
        self._requested = ""
        self._arrange()
        self._on_change()

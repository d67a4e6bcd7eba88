"""Controls of a race: the clouds, the methods, the start and the degradation of the moving cloud."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import viser

from app.screens.fuse.labels import (
    BY_HAND,
    COMPARISONS,
    DEGRADATIONS,
    DIRECTIONS,
    MOST_LANES,
    MOST_SEED,
    NO_METHOD,
    RIVAL_NAMES,
    RIVALS,
    SLIGHTLY,
    STARTS,
    UNDEGRADED,
)
from app.screens.fuse.place import FIRST
from app.screens.fuse.view import OF_NODES, Race, RaceMode, Rival, Start
from app.window.ui import Ui

DECIMALS = 9
"""Decimals of a degradation, so that 7 % is 0.07 in an address, not 0.07000000000000002."""
METHOD_HINT = "Method and what it minimises: distance to the paired point, or to the plane at it."


class RaceSetup:
    """The controls of a ``Race``."""

    def __init__(self, ui: Ui, on_change: Callable[[], object]) -> None:
        """Start without controls; the panel adds them by the ``add_`` methods."""
        self._ui, self._on_change = ui, on_change
        self._race = FIRST
        self._from_address = False
        """Whether the nodes come from an address; its scene may not be loaded yet."""
        self._slots: list[viser.GuiDropdownHandle[str]] = []

    def add_comparisons(self) -> None:
        """Add buttons for the comparisons."""
        actions = {
            name: functools.partial(self._picked_rivals, rivals) for name, rivals in COMPARISONS.items()
        }
        self._ui.buttons(
            "Compare",
            actions,
            "Two weightings with one metric; two metrics with one weighting; or all four combinations.",
        )

    def add_methods(self, labels: Sequence[str]) -> None:
        """Add the next drop-downs of methods; all but the first may stay empty."""
        for label in labels:
            index, rivals = len(self._slots), self._race.rivals
            handle = self._ui.gui.add_dropdown(
                label,
                list(RIVALS) if index == 0 else [NO_METHOD, *RIVALS],
                initial_value=RIVAL_NAMES[rivals[index]] if index < len(rivals) else NO_METHOD,
                hint=METHOD_HINT,
            )
            self._slots.append(handle)
            self._ui.when_changed(handle, self._picked)

    def add_preset(self) -> None:
        """Add the choice of a start by name."""
        self._preset = self._ui.gui.add_dropdown(
            "Start",
            [*STARTS, BY_HAND],
            initial_value=SLIGHTLY,
            hint="Start error of the moving cloud, from its true pose or, if that is unknown, from the "
            "nodes' own poses. An inferred cloud's true pose is that of its own pixels.",
        )
        self._ui.when_changed(self._preset, self._picked_preset)

    def add_nodes(self) -> None:
        """Add drop-downs for the moving node, the fixed node, and the search direction for pairs."""
        gui, names = self._ui.gui, ["node_00", "node_01"]
        self._source = gui.add_dropdown(
            "Move", names, initial_value=names[1], hint="Node whose cloud moves (coloured)."
        )
        self._target = gui.add_dropdown("onto", names, hint="Node whose cloud stays (grey).")
        self._direction = gui.add_dropdown(
            "Pairs",
            list(DIRECTIONS),
            hint="Cloud whose points are paired with their nearest points in the other cloud.",
        )
        for handle in (self._source, self._target, self._direction):
            self._ui.when_changed(handle, self._picked)

    def add_numbers(self) -> None:
        """Add the start's rotation and shift."""
        gui, start = self._ui.gui, self._race.start
        self._turn = gui.add_vector3(
            "Turn (°)",
            start.turn_deg,
            step=0.5,
            hint="Rotation vector about the cloud's centre, along the axes of the fixed node's camera, "
            "in degrees.",
        )
        self._shift = gui.add_vector3(
            "Shift (cm)", start.shift_cm, step=0.5, hint="Translation along the same axes, in centimetres."
        )
        for handle in (self._turn, self._shift):
            self._ui.when_changed(handle, self._picked_numbers)
        self._seed = gui.add_slider(
            "Seed",
            0,
            MOST_SEED,
            1,
            0,
            hint="Seed of the start error's directions and of the cloud's degradation.",
        )
        self._ui.when_changed(self._seed, self._picked_preset)

    def add_degradations(self) -> None:
        """Add the sliders of the moving cloud's degradation."""
        self._undegraded = self._ui.gui.add_markdown(UNDEGRADED, visible=False)
        self._worse = {
            name: self._ui.gui.add_slider(label, 0.0, most, step, 0.0, hint=hint)
            for name, (label, most, step, _, hint) in DEGRADATIONS.items()
        }
        for handle in self._worse.values():
            self._ui.when_changed(handle, self._picked)

    @property
    def race(self) -> Race:
        """The race that the controls show."""
        return self._race

    def reset(self, mode: RaceMode) -> None:
        """Restore the first race."""
        names = self._source.options
        self._source.value, self._target.value = names[min(1, len(names) - 1)], names[0]
        self.write(Race(mode=mode, start=FIRST.start))
        self._race = self._between_chosen(self._race)

    def choose_nodes(self, names: Sequence[str]) -> None:
        """Offer the nodes of another scene."""
        if tuple(names) != tuple(self._source.options):
            self._source.options = self._target.options = tuple(names)
            self._source.value, self._target.value = names[min(1, len(names) - 1)], names[0]
        if self._from_address:
            self._show_nodes()
        self._from_address = False
        self._race = self._between_chosen(self._race)

    def choose(self, race: Race) -> None:
        """Show another race between its own nodes, now or when the scene's nodes are known."""
        self.write(race)
        self._race, self._from_address = race, True
        self._show_nodes()

    def _show_nodes(self) -> None:
        """Show the race's nodes, or the first race's if the scene lacks one of them."""
        names, race = self._source.options, self._race
        there = max(race.source, race.target) < len(names)
        source, target = (race.source, race.target) if there else (min(1, len(names) - 1), 0)
        self._source.value, self._target.value = names[source], names[target]

    def _between_chosen(self, race: Race) -> Race:
        """Return ``race`` between the nodes that are chosen."""
        names = list(self._source.options)
        return replace(race, source=names.index(self._source.value), target=names.index(self._target.value))

    def choose_mode(self, mode: RaceMode) -> None:
        """Race two nodes, one node's inferred cloud, or the scans of a synthetic room.

        A room has no nodes, and its scans cannot be degraded, because the scanners stood inside it.
        """
        self._race = replace(self._race, mode=mode)
        room = mode not in OF_NODES
        self._source.disabled, self._target.disabled = room, mode != "nodes"
        self._undegraded.visible = room
        for handle in self._worse.values():
            handle.disabled = room
            handle.value = 0.0 if room else handle.value
        if room:
            whole: dict[str, Any] = dict.fromkeys(self._worse, 0.0)
            self._race = replace(self._race, **whole)

    def write(self, race: Race) -> None:
        """Show another race, between the nodes that are chosen."""
        self._race = replace(race, source=self._race.source, target=self._race.target)
        rivals = [RIVAL_NAMES[rival] for rival in race.rivals]
        rivals += [NO_METHOD] * (MOST_LANES - len(rivals))
        for slot, name in zip(self._slots, rivals, strict=True):
            slot.value = name
        self._direction.value = next(name for name, way in DIRECTIONS.items() if way == race.direction)
        self._seed.value = race.seed
        for name, handle in self._worse.items():
            handle.value = round(DEGRADATIONS[name][3] * getattr(race, name), DECIMALS)
        self.choose_mode(race.mode)
        self.write_start(race.start)

    def write_start(self, start: Start) -> None:
        """Show another start; as a preset if it is one."""
        self._race = replace(self._race, start=start)
        self._turn.value, self._shift.value = start.turn_deg, start.shift_cm
        self._preset.value = next(
            (name for name, error in STARTS.items() if Start.towards(*error, self._race.seed) == start),
            BY_HAND,
        )

    def _read(self, race: Race) -> Race:
        """Return ``race`` with the values of the controls of clouds and methods."""
        worse = {
            name: round(handle.value / DEGRADATIONS[name][3], DECIMALS)
            for name, handle in self._worse.items()
        }
        return replace(
            self._between_chosen(race),
            rivals=tuple(RIVALS[slot.value] for slot in self._slots if slot.value != NO_METHOD),
            direction=DIRECTIONS[self._direction.value],
            seed=int(self._seed.value),
            **worse,
        )

    def _picked(self) -> None:
        self._race = self._read(self._race)
        self._on_change()

    def _picked_rivals(self, rivals: tuple[Rival, ...]) -> None:
        self.write(replace(self._race, rivals=rivals))
        self._on_change()

    def _picked_preset(self) -> None:
        self._race = self._read(self._race)
        if self._preset.value != BY_HAND:
            self.write_start(Start.towards(*STARTS[self._preset.value], self._race.seed))
        self._on_change()

    def _picked_numbers(self) -> None:
        turn, shift = ((float(x), float(y), float(z)) for x, y, z in (self._turn.value, self._shift.value))
        self.write_start(Start(turn, shift))
        self._on_change()

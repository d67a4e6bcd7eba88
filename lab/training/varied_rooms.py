"""Rooms furnished from a catalogue: real models at true size, much clutter, light from noon to night."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from lab.training.dressing import dressed, placed_size_m
from lab.training.furniture import Catalogue, Entry, Role
from lab.training.models import GRID
from lab.training.shells import mirror, photographed_shell, skirting
from lab.worlds import pieces
from lab.worlds.furniture import placing
from lab.worlds.room_finishes import lamp_white
from lab.worlds.scene import Light, Part, Scene
from lab.worlds.shell import wall_length, wall_pose
from pipeline.types import CameraIntrinsics, FloatArray

CAMERA = CameraIntrinsics.pinhole(262.5, 262.5, 159.5, 119.5, 320, 240)
"""A Kinect's colour camera at half its size."""
_THEMES = ("Living room", "Living room", "Bedroom", "Kitchen", "Bathroom", "Office")
_MOST_LIGHTS = 3
_FLAT_M = 0.012
"""Largest height difference of a support under an object that stands on it."""


@dataclass(frozen=True, slots=True)
class Placed:
    """An object in a room, with its bounding box."""

    low_m: FloatArray
    """(3,) lowest corner, world frame."""
    high_m: FloatArray
    entry: Entry | None = None
    """Catalogue entry; None for other objects."""
    T: FloatArray | None = None
    """(4, 4) pose of the middle of its foot."""
    support: Placed | None = None
    """The object below it; None for floor and walls."""


@dataclass(slots=True)
class RoomPlan:
    """A room that is being furnished; parts[0] is the floor slab, parts[:6] the shell."""

    seed: int
    size_m: FloatArray
    """(3,) inner width (x), depth (y) and height."""
    theme: str
    daylight: float
    """Brightness of the light from windows and of the catalogue's panes; 0 at night."""
    catalogue: Catalogue
    rng: np.random.Generator
    parts: list[Part]
    placed: list[Placed] = field(default_factory=list)
    windows: list[FloatArray] = field(default_factory=list)
    """(3,) positions in front of windows, at which their light is placed."""

    def pick(self, role: Role) -> Entry | None:
        """Return a random entry of a role, preferably of the room's theme; None if the role has none."""
        entries = self.catalogue.of_role(role)
        themed = [entry for entry in entries if entry.category == self.theme]
        choice = themed if themed and self.rng.random() < 0.7 else entries
        return choice[self.rng.integers(len(choice))] if choice else None

    def fits(self, low_m: FloatArray, high_m: FloatArray, support: Placed | None = None) -> bool:
        """Return whether a box is inside the room and overlaps no object except its support."""
        half = 0.5 * self.size_m[:2] + 1e-6
        if np.any(low_m[:2] < -half) or np.any(high_m[:2] > half) or high_m[2] > self.size_m[2] + 1e-6:
            return False
        others = [thing for thing in self.placed if thing is not support]
        if not others:
            return True
        lows = np.array([thing.low_m for thing in others])
        highs = np.array([thing.high_m for thing in others])
        return not np.any(np.all((low_m < highs - 1e-6) & (high_m > lows + 1e-6), axis=1))

    def add(self, entry: Entry, T: FloatArray, support: Placed | None = None) -> Placed | None:
        """Put an object at ``T`` and return it; None if it does not fit there."""
        low, high = box_at(placed_size_m(entry), T)
        if not self.fits(low, high, support):
            return None
        thing = Placed(low, high, entry, T, support)
        self.placed.append(thing)
        self.parts += dressed(entry, self.catalogue.model(entry), T, self.rng, self.daylight)
        return thing


def varied_room(seed: int, catalogue: Catalogue) -> Scene:
    """Return a closed, furnished, lit room without cameras (see ``varied_views``); equal for equal seeds."""
    plan = plan_room(seed, catalogue)
    lights, ambient = _lights(plan)
    return Scene(f"varied-room-{seed}", tuple(plan.parts), lights, ambient, (), CAMERA)


def plan_room(seed: int, catalogue: Catalogue) -> RoomPlan:
    """Return the room of a seed with all its furniture."""
    rng = np.random.default_rng([seed, 8117])
    size_m = np.array([rng.uniform(2.6, 6.0), rng.uniform(2.6, 6.0), rng.uniform(2.4, 3.2)])
    if rng.random() < 0.12:
        size_m[:2] *= 1.5
    daylight = float(rng.choice([0.0, rng.uniform(0.8, 4.0)], p=[0.3, 0.7]))
    theme = str(rng.choice(_THEMES))
    parts = photographed_shell(rng, size_m, catalogue.images)
    plan = RoomPlan(seed, size_m, theme, daylight, catalogue, rng, parts)
    if rng.random() < 0.6:
        plan.parts += skirting(rng, size_m)
    _dress_walls(plan)
    _furnish_walls(plan)
    _furnish_middle(plan)
    _hang_lamps(plan)
    _clutter(plan)
    return plan


def box_at(size_m: FloatArray, T: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the corners of the upright box around an object of ``size_m`` with foot pose ``T``."""
    half = np.abs(T[:3, :3]) @ (0.5 * size_m)
    middle = T[:3, 3] + T[:3, 2] * 0.5 * size_m[2]
    return middle - half, middle + half


def _dress_walls(plan: RoomPlan) -> None:
    """Hang windows, doors, mirrors, pictures, shelves and others, from left to right on each wall."""
    rng = plan.rng
    for wall in range(4):
        length = wall_length(plan.size_m, wall)
        along = -0.5 * length + rng.uniform(0.1, 0.6)
        while along < 0.5 * length - 0.1:
            kind = rng.random()
            if kind < 0.35:
                along += _hang_made(plan, wall, along)
            elif kind < 0.45:
                parts, size = mirror(rng)
                T = wall_pose(plan.size_m, wall, along + 0.5 * size[0], 0.017, rng.uniform(0.1, 1.0))
                along += size[0] if _add_made(plan, pieces.moved(parts, T)) else 0.1
            else:
                along += _hang_entry(plan, wall, along)
            along += rng.uniform(0.05, 1.0)


def _hang_made(plan: RoomPlan, wall: int, along_m: float) -> float:
    """Hang a random procedural wall piece; return its width, metres, or 0.1 if it does not fit."""
    piece = pieces.from_stock(pieces.random_wall_piece, plan.seed, plan.rng)
    T = wall_pose(plan.size_m, wall, along_m + 0.5 * piece.width_m, 0.0, piece.height_m)
    if not _add_made(plan, pieces.moved(piece.parts, T)):
        return 0.1
    if piece.daylight:
        plan.windows.append((T @ np.array([0.0, -0.35, 0.6, 1.0]))[:3])
    return float(piece.width_m)


def _add_made(plan: RoomPlan, parts: list[Part]) -> bool:
    """Add procedural parts on a wall if they fit, and return whether they do.

    What is inside the wall, up to 20 cm, is left out of the test.
    """
    half = 0.5 * plan.size_m[:2]
    low, high = pieces.bounds(parts)
    behind = 0.2
    if np.any(low[:2] < -half - behind) or np.any(high[:2] > half + behind):
        return False
    low, high = low.copy(), high.copy()
    low[:2], high[:2] = np.maximum(low[:2], -half), np.minimum(high[:2], half)
    if not plan.fits(low, high):
        return False
    plan.placed.append(Placed(low, high))
    plan.parts += parts
    return True


def _hang_entry(plan: RoomPlan, wall: int, along_m: float) -> float:
    """Hang a random object of the catalogue; return its width, metres, or 0.1 to 0.5 if nothing fits."""
    entry = plan.pick("opening" if plan.rng.random() < 0.25 else "wall")
    if entry is None:
        return 0.5
    size = placed_size_m(entry)
    fixed = entry.elevation_m > 0.0 or entry.role == "opening"
    z = entry.elevation_m if fixed else plan.rng.uniform(0.9, 1.6)
    z = min(z, plan.size_m[2] - size[2] - 0.02)
    if z < 0.0:
        return 0.1
    T = wall_pose(plan.size_m, wall, along_m + 0.5 * size[0], 0.5 * size[1], z)
    if plan.add(entry, T) is None:
        return 0.1
    if entry.role == "opening" and entry.elevation_m > 0.05 and plan.daylight > 0.0:
        plan.windows.append((T @ np.array([0.0, -0.35, 0.6 * size[2], 1.0]))[:3])
    return float(size[0])


def _furnish_walls(plan: RoomPlan) -> None:
    """Add beds, sofas, cupboards, desks and appliances with their backs to the walls."""
    rng = plan.rng
    for _ in range(int(rng.integers(3, 6) + plan.size_m[:2].prod() / 6.0)):
        entry = plan.pick("against" if rng.random() < 0.8 else "table")
        if entry is None:
            return
        for _ in range(10):
            wall = int(rng.integers(4))
            reach = 0.5 * wall_length(plan.size_m, wall) - 0.5 * entry.size_m[0]
            if reach <= 0.0:
                continue
            inset = 0.5 * entry.size_m[1] + rng.choice([0.015, rng.uniform(0.015, 0.2)])
            thing = plan.add(entry, wall_pose(plan.size_m, wall, rng.uniform(-reach, reach), inset))
            if thing is not None:
                if entry.role == "table":
                    _seat(plan, thing)
                break


def _furnish_middle(plan: RoomPlan) -> None:
    """Add a rug, tables with chairs, and single objects, some of them procedural."""
    rng = plan.rng
    if rng.random() < 0.35:
        x, y = rng.uniform(-0.2, 0.2, 2) * plan.size_m[:2]
        plan.parts += pieces.moved(pieces.random_rug(rng), placing.place(x, y, rng.uniform(0.0, 2.0 * np.pi)))
    counts: dict[Role, tuple[int, int]] = {"table": (1, 2), "chair": (0, 2), "free": (2, 6), "small": (0, 6)}
    roles = [role for role, (few, many) in counts.items() for _ in range(int(rng.integers(few, many + 1)))]
    for role in roles:
        entry = plan.pick(role)
        thing = _drop(plan, entry) if entry is not None else None
        if thing is not None and role == "table":
            _seat(plan, thing)
    for _ in range(int(rng.integers(0, 4))):
        piece = pieces.from_stock(pieces.random_floor_thing, plan.seed, rng)
        x, y = rng.uniform(-0.45, 0.45, 2) * plan.size_m[:2]
        moved = pieces.moved(piece, placing.place(x, y, rng.uniform(0.0, 2.0 * np.pi)))
        low, high = pieces.bounds(moved)
        if plan.fits(low, high):
            plan.placed.append(Placed(low, high))
            plan.parts += moved


def _drop(plan: RoomPlan, entry: Entry) -> Placed | None:
    """Put an object at random on the floor and return it; None if it does not fit.

    Half of the objects are parallel to the walls.
    """
    for _ in range(8):
        x, y = plan.rng.uniform(-0.48, 0.48, 2) * plan.size_m[:2]
        square = plan.rng.integers(4) * np.pi / 2.0
        yaw = square if plan.rng.random() < 0.5 else plan.rng.uniform(0.0, 2.0 * np.pi)
        thing = plan.add(entry, placing.place(x, y, yaw))
        if thing is not None:
            return thing
    return None


def _seat(plan: RoomPlan, table: Placed) -> None:
    """Add chairs of one kind around a table, each turned to it."""
    chair = plan.pick("chair")
    if chair is None or table.entry is None or table.T is None:
        return
    size, seat = table.entry.size_m, chair.size_m
    for side in range(4):
        across, along = (size[1], size[0]) if side % 2 == 0 else (size[0], size[1])
        count = min(int(along / (seat[0] + 0.1)), 3)
        for k in range(count):
            if plan.rng.random() < 0.35:
                continue
            x = (k + 0.5 - 0.5 * count) * along / count
            y = -0.5 * across - 0.5 * seat[1] - plan.rng.uniform(0.02, 0.2)
            turn = np.pi + plan.rng.choice([0.0, plan.rng.normal(0.0, 0.2)])
            plan.add(chair, table.T @ placing.place(0.0, 0.0, side * np.pi / 2.0) @ placing.place(x, y, turn))


def _hang_lamps(plan: RoomPlan) -> None:
    """Add up to two lamps that hang from the ceiling."""
    for _ in range(int(plan.rng.integers(0, 3))):
        entry = plan.pick("ceiling")
        if entry is not None and entry.size_m[2] < plan.size_m[2] - 1.2:
            x, y = plan.rng.uniform(-0.3, 0.3, 2) * plan.size_m[:2]
            plan.add(entry, placing.place(x, y, 0.0, plan.size_m[2] - entry.size_m[2]))


def _clutter(plan: RoomPlan) -> None:
    """Add small objects on flat tops."""
    rng = plan.rng
    supports = [thing for thing in plan.placed if thing.entry is not None and _is_support(thing.entry)]
    for support in supports:
        for _ in range(int(rng.choice([0, 1, 2, 4, 7]))):
            entry = plan.pick("small")
            T = _resting(plan, support, entry) if entry is not None else None
            if entry is not None and T is not None:
                plan.add(entry, T, support)


def _is_support(entry: Entry) -> bool:
    return entry.role in ("table", "against") and 0.3 < entry.size_m[2] < 1.6


def _resting(plan: RoomPlan, support: Placed, entry: Entry) -> FloatArray | None:
    """Return the (4, 4) pose of an object on a flat place of its support; None if six tries find none."""
    assert support.entry is not None
    assert support.T is not None
    size, top = support.entry.size_m, plan.catalogue.model(support.entry).top_m
    for _ in range(6):
        yaw = plan.rng.choice([0.0, plan.rng.uniform(0.0, 2.0 * np.pi)])
        low, high = box_at(entry.size_m, placing.place(0.0, 0.0, yaw))
        room = 0.5 * size[:2] - high[:2]
        if np.any(room <= 0.0):
            continue
        x, y = plan.rng.uniform(-room, room)
        first = np.floor(((np.array([x, y]) + low[:2]) / size[:2] + 0.5) * GRID).astype(int)
        last = np.ceil(((np.array([x, y]) + high[:2]) / size[:2] + 0.5) * GRID).astype(int)
        under = top[max(first[0], 0) : last[0], max(first[1], 0) : last[1]]
        if under.size and np.isfinite(under).all() and np.ptp(under) < _FLAT_M:
            return np.asarray(support.T @ placing.place(x, y, yaw, float(under.max())))
    return None


def _lights(plan: RoomPlan) -> tuple[tuple[Light, ...], FloatArray]:
    """Return one to three area lights and ambient light, as at noon, on a grey day or in the evening."""
    rng = plan.rng
    lights = []
    for place in plan.windows[:2] if plan.daylight > 0.0 else ():
        sky = np.array([0.85, 0.95, 1.1]) * rng.uniform(0.8, 1.2, 3)
        lights.append(Light(place, sky * plan.daylight, rng.uniform(0.3, 0.6)))
    for lamp in (p for p in plan.placed if p.entry is not None and p.entry.light_m is not None):
        if rng.random() < 0.8:
            strength = rng.uniform(0.8, 3.5) if lamp.low_m[2] > 1.5 else rng.uniform(0.2, 1.2)
            lights.append(Light(_shining(lamp), _white(rng) * strength, rng.uniform(0.03, 0.15)))
    rng.shuffle(lights)
    if not lights or rng.random() < 0.3:
        x, y = rng.uniform(-0.4, 0.4, 2) * plan.size_m[:2]
        place = np.array([x, y, plan.size_m[2] - rng.uniform(0.1, 0.4)])
        lights.insert(0, Light(place, _white(rng) * rng.uniform(0.8, 3.5), rng.uniform(0.05, 0.4)))
    ambient = 0.5 * (_white(rng) + 1.0) * rng.choice([rng.uniform(0.03, 0.1), rng.uniform(0.1, 0.45)])
    return tuple(lights[:_MOST_LIGHTS]), ambient


def _shining(lamp: Placed) -> FloatArray:
    """Return the (3,) position of a lamp's light in the world."""
    assert lamp.entry is not None
    assert lamp.entry.light_m is not None
    assert lamp.T is not None
    return np.asarray(lamp.T[:3, :3] @ lamp.entry.light_m + lamp.T[:3, 3])


def _white(rng: np.random.Generator) -> FloatArray:
    """Return (3,) light of a colour temperature from about 2700 to 8000 K, sometimes of a coloured lamp."""
    white = lamp_white(rng)
    return white * rng.uniform(0.3, 1.3, 3) if rng.random() < 0.08 else white

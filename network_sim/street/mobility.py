"""Vehicles on a square grid of streets: routes, positions, road cells, contacts with access points.

The scenario is our reconstruction (SPEC 6.2) of Bruno & Nurchis, "Efficient data collection in multimedia
vehicular sensing platforms" (arXiv 1311.6013). All vehicles drive at the same speed and choose a random way
at every crossing, never back. So a route is a sequence of crossings, and positions, cells and contacts have
closed forms.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, hypot, sqrt

import numpy as np

from network_sim.config import NetworkConfig, StreetConfig
from network_sim.types import NS_PER_S
from packetmesh.errors import InputError

STEPS = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
"""Blocks to the east and north for each heading: east, north, west, south."""
MAX_CELLS = 2**15
"""Largest number of cells: the trace stores a cell in the 16-bit column of a node."""


@dataclass(frozen=True, slots=True)
class Routes:
    """The route of every vehicle. A vehicle starts ``start_m`` into its first segment."""

    config: StreetConfig
    crossings: np.ndarray
    """(V, S + 1) crossings in order; crossing ``x + y (blocks + 1)`` is ``x`` blocks east, ``y`` north."""
    headings: np.ndarray
    """(V, S) heading from each crossing to the next."""
    start_m: np.ndarray
    """(V,) distance already driven in the first segment at time 0."""

    def segments(self, vehicle: int, t_ns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return a vehicle's segment index, and the metres driven in it, at times ``t_ns`` (T,)."""
        driven_m = self.start_m[vehicle] + self.config.speed_mps / NS_PER_S * t_ns
        segment = (driven_m / self.config.block_m).astype(np.int64)
        return segment, driven_m - segment * self.config.block_m

    def cells(self, vehicle: int, t_ns: np.ndarray, cell_m: float, directed: bool = True) -> np.ndarray:
        """Return (T,) the vehicle's cell at each time, a number below ``cell_numbers()``.

        Args:
            vehicle: Number of the vehicle.
            t_ns: Times (T,).
            cell_m: Length of a cell.
            directed: True gives each direction of a street its own cells; otherwise both share them.
        """
        segment, into_m = self.segments(vehicle, t_ns)
        crossing, heading = self.crossings[vehicle, segment], self.headings[vehicle, segment]
        end = self.crossings[vehicle, segment + 1]
        return self._numbers(crossing, end, heading, into_m, cell_m, directed)

    def cells_ahead(
        self, vehicle: int, t_ns: np.ndarray, cell_m: float, count: int, directed: bool = True
    ) -> np.ndarray:
        """Return (T, count) the vehicle's cell and those straight ahead of it; -1 beyond the grid's border.

        A camera looks straight ahead over a crossing, whichever way its vehicle turns there. Arguments as
        in ``cells``.
        """
        segment, into_m = self.segments(vehicle, t_ns)
        crossing = self.crossings[vehicle, segment][:, None]
        heading = self.headings[vehicle, segment][:, None]
        ahead_m = into_m[:, None] + cell_m * np.arange(count)
        blocks = (ahead_m / self.config.block_m).astype(np.int64)
        side = self.config.blocks + 1
        start = np.stack((crossing % side, crossing // side), axis=-1) + STEPS[heading] * blocks[..., None]
        end = start + STEPS[heading]
        inside = ((end >= 0) & (end < side)).all(axis=2)
        start, end = start @ (1, side), end @ (1, side)
        into_m = ahead_m - blocks * self.config.block_m
        return np.where(inside, self._numbers(start, end, heading, into_m, cell_m, directed), -1)

    def _numbers(
        self,
        start: np.ndarray,
        end: np.ndarray,
        heading: np.ndarray,
        into_m: np.ndarray,
        cell_m: float,
        directed: bool,
    ) -> np.ndarray:
        """Return the cell that is ``into_m`` from the crossing ``start`` towards ``end``."""
        if not directed:  # number the cells as if all vehicles drove east or north
            back = heading >= len(STEPS) // 2
            start = np.where(back, end, start)
            heading = heading % (len(STEPS) // 2)
            into_m = np.where(back, self.config.block_m - into_m, into_m)
        pieces = pieces_of_block(self.config, cell_m)
        piece = np.minimum((into_m / cell_m).astype(np.int64), pieces - 1)
        return (start * len(STEPS) + heading) * pieces + piece


@dataclass(frozen=True, slots=True)
class Contact:
    """Time span in which a vehicle is within range of an access point."""

    access_point: int
    enter_ns: int
    leave_ns: int


class StreetPlaces:
    """Positions of the vehicles, then of the access points."""

    static = False

    def __init__(self, routes: Routes, access_points_m: np.ndarray) -> None:
        """Prepare positions from the routes and the access points' positions (A, 2)."""
        config = routes.config
        self._segments_per_ns = config.speed_mps / config.block_m / NS_PER_S
        self._start = (routes.start_m / config.block_m).tolist()
        points_m = crossings_m(config)[routes.crossings]
        self._x_m: list[list[float]] = points_m[..., 0].tolist()
        self._y_m: list[list[float]] = points_m[..., 1].tolist()
        self._vehicles = len(points_m)
        self._fixed: list[tuple[float, float]] = [(x, y) for x, y in access_points_m.tolist()]

    @property
    def count(self) -> int:
        """Number of vehicles and access points together."""
        return self._vehicles + len(self._fixed)

    def position_m(self, node: int, now_ns: int) -> tuple[float, float]:
        """Return a node's position in metres east and north of the south-western crossing."""
        if node >= self._vehicles:
            return self._fixed[node - self._vehicles]
        driven = self._start[node] + self._segments_per_ns * now_ns
        segment = int(driven)
        part = driven - segment
        x_m, y_m = self._x_m[node], self._y_m[node]
        x0_m, y0_m = x_m[segment], y_m[segment]
        return x0_m + part * (x_m[segment + 1] - x0_m), y0_m + part * (y_m[segment + 1] - y0_m)

    def distance_m(self, a: int, b: int, now_ns: int) -> float:
        """Return the distance of two nodes at ``now_ns``."""
        ax_m, ay_m = self.position_m(a, now_ns)
        bx_m, by_m = self.position_m(b, now_ns)
        return hypot(ax_m - bx_m, ay_m - by_m)


def crossings_m(config: StreetConfig) -> np.ndarray:
    """Return the positions (C, 2) of all crossings, C = (blocks + 1)^2."""
    y, x = np.divmod(np.arange((config.blocks + 1) ** 2), config.blocks + 1)
    return np.column_stack([x, y]) * config.block_m


def access_points_m(config: StreetConfig) -> np.ndarray:
    """Return the positions (A, 2) of the access points: at crossings, spread evenly over the grid."""
    side = ceil(sqrt(config.access_points))
    even = (np.arange(side) + 0.5) / side * config.blocks
    # Halves are rounded outwards: the pattern stays symmetric and no two points coincide.
    along = np.where(even < config.blocks / 2, np.ceil(even - 0.5), np.floor(even + 0.5))
    chosen = np.linspace(0, side**2 - 1, config.access_points).round().astype(int)
    y, x = np.divmod(chosen, side)
    return np.column_stack([along[x], along[y]]) * config.block_m


def cell_numbers(config: StreetConfig, cell_m: float) -> int:
    """Return the count of cell numbers; those of streets that would leave the grid stay unused.

    Raises:
        InputError: there are more than ``MAX_CELLS`` cells.
    """
    numbers = (config.blocks + 1) ** 2 * len(STEPS) * pieces_of_block(config, cell_m)
    if numbers > MAX_CELLS:
        raise InputError(
            f"scheme.cell_m is {cell_m}, which divides the streets into {numbers} cells, more than "
            f"{MAX_CELLS}; try longer cells or fewer blocks"
        )
    return numbers


def cells_m(config: StreetConfig, cell_m: float) -> np.ndarray:
    """Return (C, 2, 2) start and end of every cell in driving direction, ordered by cell number."""
    pieces = pieces_of_block(config, cell_m)
    ends_m = np.minimum(np.arange(pieces + 1) * cell_m, config.block_m)
    into_m = np.stack((ends_m[:-1], ends_m[1:]), axis=1)
    ways_m = STEPS[:, None, None] * into_m[..., None]
    return (crossings_m(config)[:, None, None, None] + ways_m).reshape(-1, 2, 2)


def drive(config: StreetConfig, horizon_s: float, rng: np.random.Generator) -> Routes:
    """Draw random routes that last until the horizon.

    Vehicles start uniformly distributed over the streets, and stay so distributed: every way into a crossing
    and every way out of it are equally likely.
    """
    side = config.blocks + 1
    x, y = np.arange(side**2) % side, np.arange(side**2) // side
    ahead = np.stack([x, y], axis=1)[:, None] + STEPS
    open_ways = ((ahead >= 0) & (ahead < side)).all(axis=2)
    turns, turn_counts = _turns(open_ways)
    count = ceil(horizon_s * config.speed_mps / config.block_m) + 2
    crossings = np.empty((config.vehicles, count + 1), dtype=np.int64)
    headings = np.empty((config.vehicles, count), dtype=np.int64)
    first = np.argwhere(open_ways)[rng.integers(open_ways.sum(), size=config.vehicles)]
    crossings[:, 0], headings[:, 0] = first.T
    start_m = rng.random(config.vehicles) * config.block_m
    jump = STEPS @ (1, side)
    for i, draw in enumerate(rng.random((count, config.vehicles))):
        here = crossings[:, i] + jump[headings[:, i]]
        crossings[:, i + 1] = here
        if i + 1 < count:
            choice = (draw * turn_counts[here, headings[:, i]]).astype(np.int64)
            headings[:, i + 1] = turns[here, headings[:, i], choice]
    return Routes(config, crossings, headings, start_m)


def random_streams(rng: np.random.Generator) -> list[np.random.Generator]:
    """Return a run's streams of driving, first images, requests, radio, medium and medium access."""
    street, *others = rng.spawn(4)
    return [*street.spawn(3), *others]


def routes_of(config: NetworkConfig) -> Routes:
    """Return the routes of the vehicles in the street-grid run of this config, without running it."""
    driving = random_streams(np.random.default_rng(config.run.seed))[0]
    return drive(config.street, config.run.horizon_s, driving)


def contacts(routes: Routes, points_m: np.ndarray, range_m: float) -> list[list[Contact]]:
    """Compute each vehicle's contacts with the points (A, 2), in order of entering their range.

    A segment intersects the disc around a point in at most one piece; pieces that touch at a crossing form
    one contact.
    """
    start_m = crossings_m(routes.config)[routes.crossings[:, :-1]]
    ahead = STEPS[routes.headings]
    found: list[list[Contact]] = [[] for _ in range(len(start_m))]
    for index, point_m in enumerate(points_m):
        to_m = point_m - start_m
        middle_m = (to_m * ahead).sum(axis=2)
        aside_m = to_m[..., 0] * ahead[..., 1] - to_m[..., 1] * ahead[..., 0]
        half_m = np.sqrt(np.maximum(range_m**2 - aside_m**2, 0.0))
        enter_m = np.clip(middle_m - half_m, 0.0, routes.config.block_m)
        leave_m = np.clip(middle_m + half_m, 0.0, routes.config.block_m)
        for vehicle, enter_ns, leave_ns in _joined(routes, enter_m, leave_m):
            found[vehicle].append(Contact(index, enter_ns, leave_ns))
    return [sorted(each, key=lambda contact: contact.enter_ns) for each in found]


def _joined(routes: Routes, enter_m: np.ndarray, leave_m: np.ndarray) -> list[tuple[int, int, int]]:
    """Join pieces (V, S) of segments that touch; returns (vehicle, enter_ns, leave_ns) of each."""
    config = routes.config
    inside = leave_m > enter_m
    goes_on = inside[:, :-1] & inside[:, 1:] & (leave_m[:, :-1] == config.block_m) & (enter_m[:, 1:] == 0.0)
    none = np.zeros((len(inside), 1), dtype=bool)
    begins = inside & ~np.hstack([none, goes_on])
    ends = inside & ~np.hstack([goes_on, none])
    offset_m = np.arange(inside.shape[1]) * config.block_m - routes.start_m[:, None]
    ns_per_m = NS_PER_S / config.speed_mps
    enter_ns = np.maximum(np.ceil((offset_m + enter_m)[begins] * ns_per_m), 0.0).astype(np.int64)
    leave_ns = np.floor((offset_m + leave_m)[ends] * ns_per_m).astype(np.int64)
    vehicle = np.nonzero(begins)[0]
    lasts = leave_ns > enter_ns
    rows = zip(vehicle[lasts].tolist(), enter_ns[lasts].tolist(), leave_ns[lasts].tolist(), strict=True)
    return list(rows)


def _turns(open_ways: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return possible next headings (C, 4, 3) by crossing and heading of arrival, and their count (C, 4)."""
    turns = np.zeros((len(open_ways), 4, 3), dtype=np.int64)
    counts = np.zeros((len(open_ways), 4), dtype=np.int64)
    for crossing, ways in enumerate(open_ways):
        for heading in range(4):
            onward = [way for way in range(4) if ways[way] and way != (heading + 2) % 4]
            turns[crossing, heading, : len(onward)] = onward
            counts[crossing, heading] = len(onward)
    return turns, counts


def pieces_of_block(config: StreetConfig, cell_m: float) -> int:
    """Return the number of cells of one side of a block, in one direction."""
    return ceil(config.block_m / cell_m)

"""Drawing of networks from above: nodes, ranges and streets to scale, packets as one batch of points."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import viser

from app.drawing.cameras import turn
from app.drawing.clouds import clear
from app.drawing.colors import BACKGROUND, BRAND, COVERAGE_STOPS, DELIVERED, LOSS, NEUTRAL, css, linear, ramp
from app.screens.network.labels import ANSWER, PACKET_COLORS
from app.screens.network.view import NetworkView, Pieces, What
from app.web.markup import Markup
from network_sim.metrics.coverage import RoadCoverage
from network_sim.radio.propagation import reach_m
from network_sim.street.mobility import cells_m
from network_sim.types import Cause
from pipeline.types import ByteArray, FloatArray

SIDE = 10.0
"""Length of a network's longer side in scene units; all lengths are drawn to one scale."""
BAR_ROOM = 0.6
"""Space south of the ground for the scale bar."""
GAP = 1.12
"""Distance of two networks over their width."""
ROLE_LOOKS: dict[str, tuple[tuple[int, int, int], float]] = {
    "node": (BRAND, 0.16),
    "vehicle": (BRAND, 0.14),
    "access-point": (DELIVERED, 0.32),
    "sink": (DELIVERED, 0.22),
    "cloud": (NEUTRAL, 0.5),
}
"""Colour and size of the point for each role."""
CLOUD_HEIGHT = 1.6
MOST_NAMES = 26
MOST_PACKETS = 400
"""Most drawn packets of each network; of more, evenly chosen ones are drawn."""
PACKET_SIZE = 0.11
ARC = 0.12
"""Height of a packet's arc over the length of its path."""
LOSS_HEIGHT = 0.22
ON_THE_WAY = (Cause.COLLISION, Cause.NOISE, Cause.RANGE, Cause.UPLINK, Cause.LINK)
"""Causes of losses that are drawn at the frame's receiver."""
CIRCLE = np.linspace(0.0, 2.0 * np.pi, 73)
STREET, RANGE, NODE_RANGE = (170, 176, 182), (0, 158, 115), (150, 170, 190)
ELEVATION_RAD = np.radians(52.0)
LANE = 0.05
"""Distance from the middle of a street to the line of one direction, in scene units."""
ROAD_WIDTH = 4.5


@dataclass(frozen=True, slots=True)
class Ground:
    """The size and scale of the ground, in scene units."""

    scale: float
    """Scene units per metre."""
    middle_m: FloatArray
    """(2,) middle of every network, which is drawn at its own origin."""
    width: float
    depth: float
    networks: int

    def offset(self, index: int) -> float:
        """Return how far east of the middle a network is drawn, scene units."""
        return (index - 0.5 * (self.networks - 1)) * GAP * self.width

    def place(self, points_m: FloatArray, index: int, height: float = 0.0) -> FloatArray:
        """Return (N, 3) places of points (N, 2) of a network."""
        flat = (points_m - self.middle_m) * self.scale
        return np.column_stack([flat[:, 0] + self.offset(index), flat[:, 1], np.full(len(flat), height)])


def ground_of(views: Sequence[NetworkView]) -> Ground:
    """Return the ground that holds all nodes of all views at any time, and the fixed nodes' ranges."""
    lows_m, highs_m = [], []
    for view in views:
        low_m, high_m = view.tracks_m.min(axis=(0, 1)), view.tracks_m.max(axis=(0, 1))
        range_m = reach_m(view.config)
        still_m = view.tracks_m[0][_still(view)]
        lows_m.append(np.minimum(low_m, (still_m - range_m).min(axis=0, initial=np.inf)))
        highs_m.append(np.maximum(high_m, (still_m + range_m).max(axis=0, initial=-np.inf)))
    low_m, high_m = np.min(lows_m, axis=0), np.max(highs_m, axis=0)
    size_m = np.maximum(high_m - low_m, 1.0)
    scale = SIDE / float(size_m.max())
    return Ground(
        scale, (low_m + high_m) / 2.0, float(size_m[0]) * scale, float(size_m[1]) * scale, len(views)
    )


def look_at_ground(clients: Iterable[viser.ClientHandle], ground: Ground) -> None:
    """Turn every browser's view to the whole ground, from the south and above."""
    width = ground.width * (1.0 + GAP * (ground.networks - 1))
    depth = ground.depth + 2.0 * BAR_ROOM
    for client in clients:
        slope = float(np.tan(0.5 * client.camera.fov))
        across = 0.5 * width / max(slope * client.camera.aspect, 1e-9)
        along = 0.5 * depth * np.sin(ELEVATION_RAD) / max(slope, 1e-9)
        distance = 1.08 * max(across, along) + 0.5 * depth * np.cos(ELEVATION_RAD)
        stand = distance * np.array([0.0, -np.cos(ELEVATION_RAD), np.sin(ELEVATION_RAD)])
        turn(client, np.zeros(3), stand)


class NetworkDrawing:
    """One or two networks below a scene node, at any time."""

    def __init__(self, scene: viser.SceneApi, below: str, views: Sequence[NetworkView]) -> None:
        clear(scene, below)
        self._scene, self._below, self._views = scene, below, views
        self.ground = ground_of(views)
        self._flights = [Flights.of(view.pieces) for view in views]
        self._roads: list[Roads | None] = []
        self._nodes: list[dict[str, viser.PointCloudHandle]] = []
        for index, view in enumerate(views):
            self._add_ground(index, view)
            self._nodes.append(self._add_nodes(index, view))
            if len(views) > 1:
                self._label(f"{index}/label", view.label, self._north(index), 1.1)
        capacity = sum(MOST_PACKETS + len(view.names) for view in views)
        self._packets = scene.add_point_cloud(
            f"{below}/packets",
            np.zeros((capacity, 3), np.float32),
            np.zeros((capacity, 3), np.uint8),
            point_size=PACKET_SIZE,
            point_shape="circle",
            point_shading="flat",
            precision="float32",
        )
        self._add_scale_bar()

    def show(self, now_ns: int, shown_ns: int) -> None:
        """Show the state at ``now_ns``.

        Args:
            now_ns: simulated time.
            shown_ns: least duration of a packet's flight, and time that a loss stays visible.
        """
        points, colors = [], []
        for index, (view, flights) in enumerate(zip(self._views, self._flights, strict=True)):
            at = self._places(index, view, view.positions_m(now_ns))
            self._move(index, view, at)
            roads = self._roads[index]
            if roads is not None:
                roads.show(now_ns)
            for one, color in (flights.packets(now_ns, shown_ns, at), flights.losses(now_ns, shown_ns, at)):
                points.append(one)
                colors.append(color)
        self._show_packets(np.concatenate(points), np.concatenate(colors))

    def _show_packets(self, points: FloatArray, colors: ByteArray) -> None:
        """Set the packets' batch, which keeps its length; unused points are hidden far below."""
        batch = np.tile(np.array((0.0, 0.0, -100.0), np.float32), (len(self._packets.points), 1))
        shade = np.tile(np.array(BACKGROUND, np.uint8), (len(batch), 1))
        batch[: len(points)], shade[: len(colors)] = points, colors
        self._packets.points, self._packets.colors = batch, shade
        self._packets.visible = bool(len(points))

    def _places(self, index: int, view: NetworkView, positions_m: FloatArray) -> FloatArray:
        """Return (N, 3) places high enough that the ground is below the points."""
        places = self.ground.place(positions_m, index)
        heights = [CLOUD_HEIGHT if role == "cloud" else 0.5 * ROLE_LOOKS[role][1] for role in view.roles]
        places[:, 2] = heights
        return places

    def _move(self, index: int, view: NetworkView, places: FloatArray) -> None:
        if len(view.track_s) > 1:
            for role, cloud in self._nodes[index].items():
                if role == "vehicle":
                    cloud.points = places[_having(view, role)].astype(np.float32)

    def _add_nodes(self, index: int, view: NetworkView) -> dict[str, viser.PointCloudHandle]:
        places = self._places(index, view, view.positions_m(view.start_ns))
        clouds = {}
        for role in dict.fromkeys(view.roles):
            color, size = ROLE_LOOKS[role]
            clouds[role] = self._scene.add_point_cloud(
                f"{self._below}/{index}/{role}",
                places[_having(view, role)].astype(np.float32),
                np.array(color, np.uint8),
                point_size=size,
                point_shape="circle",
                point_shading="gradient",
                precision="float32",
            )
        named = [row for row, role in enumerate(view.roles) if role != "vehicle"]
        for row in named[-MOST_NAMES:]:
            self._label(f"{index}/name{row}", view.names[row], places[row] + (0.0, 0.0, 0.25), 0.75)
        return clouds

    def _add_ground(self, index: int, view: NetworkView) -> None:
        street = view.config.street
        if view.config.scenario == "street-grid":
            along_m = np.arange(street.blocks + 1) * street.block_m
            far_m = along_m[-1]
            ends_m = [((x, 0.0), (x, far_m)) for x in along_m] + [((0.0, y), (far_m, y)) for y in along_m]
            flat = self.ground.place(np.array(ends_m).reshape(-1, 2), index, -0.02)
            self._lines(f"{index}/streets", flat.reshape(-1, 2, 3), STREET, 1.5)
        self._roads.append(None if view.roads is None else self._add_roads(index, view, view.roads))
        for roles, color, width in ((("node",), NODE_RANGE, 1.0), (("sink", "access-point"), RANGE, 2.5)):
            centers_m = view.tracks_m[0][[role in roles for role in view.roles]].astype(float)
            if len(centers_m):
                self._lines(f"{index}/range-{roles[0]}", self._circles(centers_m, view, index), color, width)

    def _add_roads(self, index: int, view: NetworkView, sights: RoadCoverage) -> Roads:
        """Add a line for every cell that was seen, to the right of the street's middle per direction."""
        street, scheme = view.config.street, view.config.scheme
        cells = np.unique(sights.cell)
        ends = self.ground.place(cells_m(street, scheme.cell_m)[cells].reshape(-1, 2), index, 0.01)
        ends = ends.reshape(-1, 2, 3)
        if scheme.directed_cells:
            ahead = ends[:, 1] - ends[:, 0]
            right = np.column_stack([ahead[:, 1], -ahead[:, 0], ahead[:, 2]])
            ends += LANE * (right / np.linalg.norm(right, axis=1)[:, None])[:, None]
        lines = self._lines(f"{index}/roads", ends, STREET, ROAD_WIDTH)
        return Roads(lines, sights, cells)

    def _circles(self, centers_m: FloatArray, view: NetworkView, index: int) -> FloatArray:
        """Return (S, 2, 3) segments of the receive range around each centre."""
        rim_m = reach_m(view.config) * np.column_stack([np.cos(CIRCLE), np.sin(CIRCLE)])
        flat = [self.ground.place(center_m + rim_m, index, -0.01) for center_m in centers_m]
        return np.concatenate([np.stack([one[:-1], one[1:]], axis=1) for one in flat])

    def _add_scale_bar(self) -> None:
        ground = self.ground
        length_m = _round_down(0.3 * ground.width / ground.scale)
        south = -0.5 * ground.depth - 0.25
        west = ground.offset(0) - 0.5 * ground.width
        ends = np.array([[[west, south, 0.0], [west + length_m * ground.scale, south, 0.0]]])
        self._lines("scale", ends, NEUTRAL, 4.0)
        self._label("scale/length", f"{length_m:g} m", ends[0].mean(axis=0), 0.9)

    def _north(self, index: int) -> FloatArray:
        return np.array([self.ground.offset(index), 0.5 * self.ground.depth + 0.3, 0.3])

    def _label(self, name: str, text: str, place: FloatArray, size: float) -> None:
        self._scene.add_label(
            f"{self._below}/{name}",
            text,
            position=place,
            font_screen_scale=size,
            anchor="bottom-center",
        )

    def _lines(
        self, name: str, ends: FloatArray, color: tuple[int, int, int], width: float
    ) -> viser.LineSegmentsHandle:
        return self._scene.add_line_segments(
            f"{self._below}/{name}",
            ends.astype(np.float32),
            np.array(color, np.uint8),
            thickness=width,
            thickness_units="screen",
        )


class Roads:
    """The roads in the colours of their coverage up to a time; grey without a vehicle so far."""

    def __init__(self, lines: viser.LineSegmentsHandle, sights: RoadCoverage, cells: np.ndarray) -> None:
        """Take lines, one for each of ``cells`` (C,): the cells that were ever seen."""
        self._lines, self._sights, self._cells = lines, sights, cells
        self._shown = np.zeros(0, np.uint8)

    def show(self, now_ns: int) -> None:
        """Colour the lines for a time."""
        seen, covered = (one[self._cells] for one in self._sights.counts(now_ns, int(self._cells.max()) + 1))
        colors = ramp(covered / np.maximum(seen, 1), 1.0, COVERAGE_STOPS)
        colors[seen == 0] = STREET
        if not np.array_equal(colors, self._shown):
            self._shown = colors
            self._lines.colors = np.repeat(linear(colors)[:, None], 2, axis=1)


def road_legend(views: Sequence[NetworkView]) -> Markup:
    """Return HTML of the roads' colour scale; empty without roads."""
    schemes = [view.config.scheme for view in views if view.roads is not None]
    if not schemes:
        return Markup("")
    stops = Markup(", ").join(css((int(r), int(g), int(b))) for r, g, b in COVERAGE_STOPS)
    roads = "Roads, each way" if all(scheme.directed_cells for scheme in schemes) else "Roads"
    spans = Markup(" and ").join(dict.fromkeys(f"{scheme.validity_s:g}" for scheme in schemes))
    return Markup(
        "<div style='padding: 0 0.8em 0.8em; font-size: 12px'>{}: of the {} s intervals in which a camera "
        "saw them, the share with an image that has arrived: 0 % <span style='display: inline-block; width: "
        "7em; height: 0.8em; background: linear-gradient(to right, {})'></span> 100 %; grey: not seen "
        "yet</div>"
    ).format(roads, spans, stops)


@dataclass(frozen=True, slots=True)
class Flights:
    """The frames and failures of a run, by their start."""

    frames: Pieces
    colors: ByteArray
    """(F, 3)"""
    longest_ns: int
    failures: Pieces

    @classmethod
    def of(cls, pieces: Pieces) -> Flights:
        """Return the frames that have a receiver, and all failed attempts and given-up packets."""
        flying = np.isin(pieces.what, (What.AIR, What.ACK)) & (pieces.peer >= 0)
        frames = pieces.where(flying)
        colors = np.full((len(frames), 3), ANSWER, np.uint8)
        for kind, color in PACKET_COLORS.items():
            colors[(frames.what == What.AIR) & (frames.carries == kind)] = color
        longest_ns = int((frames.end_ns - frames.start_ns).max(initial=0))
        return cls(frames, colors, longest_ns, pieces.where(np.isin(pieces.what, (What.LOSS, What.DROP))))

    def packets(self, now_ns: int, shown_ns: int, at: FloatArray) -> tuple[FloatArray, ByteArray]:
        """Return (M, 3) places and colours of the frames in flight between places ``at`` (N, 3)."""
        frames = self.frames
        rows = _since(frames, now_ns - max(shown_ns, self.longest_ns), now_ns)
        took_ns = np.maximum(frames.end_ns[rows] - frames.start_ns[rows], shown_ns)
        rows, took_ns = (column[now_ns < frames.start_ns[rows] + took_ns] for column in (rows, took_ns))
        rows, took_ns = _some(rows, MOST_PACKETS), _some(took_ns, MOST_PACKETS)
        share = ((now_ns - frames.start_ns[rows]) / np.maximum(took_ns, 1))[:, None]
        start, end = at[frames.node[rows]], at[frames.peer[rows]]
        places = (1.0 - share) * start + share * end
        length = np.linalg.norm(end - start, axis=1)
        places[:, 2] += 0.05 + 4.0 * ARC * length * (share * (1.0 - share))[:, 0]
        return places, self.colors[rows]

    def losses(self, now_ns: int, shown_ns: int, at: FloatArray) -> tuple[FloatArray, ByteArray]:
        """Return (L, 3) places and (L, 3) colours of recent losses, for nodes at places ``at`` (N, 3): at the
        receiver that did not get the frame, or at the node that could not send it.
        """
        failures = self.failures
        rows = _since(failures, now_ns - shown_ns, now_ns)
        sent = np.isin(failures.cause[rows], ON_THE_WAY)
        sent &= (failures.peer[rows] >= 0) & (failures.what[rows] == What.LOSS)
        where = np.where(sent, failures.peer[rows], failures.node[rows])
        places = at[np.unique(where)] + (0.0, 0.0, LOSS_HEIGHT)
        return places, np.full((len(places), 3), LOSS, np.uint8)


def _since(pieces: Pieces, from_ns: int, now_ns: int) -> np.ndarray:
    """Return the indices of the pieces that start after ``from_ns`` and not after ``now_ns``."""
    first, last = np.searchsorted(pieces.start_ns, (from_ns, now_ns), side="right")
    return np.arange(first, last)


def _some(rows: np.ndarray, most: int) -> np.ndarray:
    return rows if len(rows) <= most else rows[np.linspace(0, len(rows) - 1, most).astype(int)]


def _having(view: NetworkView, role: str) -> np.ndarray:
    return np.array([one == role for one in view.roles])


def _still(view: NetworkView) -> np.ndarray:
    """Return (N,) whether a node is fixed and has a range."""
    return np.array([role in ("node", "sink", "access-point") for role in view.roles])


def _round_down(length_m: float) -> float:
    """Return the length rounded down to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(length_m))
    return float(max(step * power for step in (1.0, 2.0, 5.0) if step * power <= length_m))

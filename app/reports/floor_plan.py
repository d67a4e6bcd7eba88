"""A plan's cameras on a floor plan to hang on the wall, true to scale on A4 or A3."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np

from app.drawing.colors import DELIVERED, LOSS, TARGET
from app.drawing.quantities import STANDS_ON
from app.reports.floor_plan_table import TABLE_MM, legend, table
from app.reports.labels import Labels
from app.reports.paper import Area, Color, Line, Paper, Shape, Words, box, disc
from pipeline.kernels.geometry import aim_deg
from pipeline.planning.calls import RigPlan
from pipeline.planning.floor import TALLEST_M, footprint, wedge_m
from pipeline.planning.places import floor_m
from pipeline.planning.sensors import AS_PRESENT
from pipeline.planning.walls import DAMPING_DB
from pipeline.types import FloatArray

A4_MM, A3_MM = (297.0, 210.0), (420.0, 297.0)
MARGIN_MM, HEAD_MM, AXES_MM = 10.0, 17.0, 9.0
AROUND_M = 0.25
"""Room between the surface and the frame."""
FAR_SINK_M = 1.5
"""A sink farther than this from surface and cameras is an arrow at the frame."""
WEDGE_M = 1.2
"""Length of the fields of view as they are drawn."""
AIM_MM = 9.0
"""Length of the line in the direction of a new camera's view."""
TICK_MM = 12.0
"""Least distance of two numbers on an axis."""
PRESENT = "present"
FLOOR, THINGS, WALL, GRID, INK = (238, 240, 242), (176, 184, 192), (60, 66, 72), (216, 222, 228), (20, 24, 28)


@dataclass(frozen=True, slots=True)
class DrawnCamera:
    """A camera on the floor plan."""

    name: str
    place_m: FloatArray
    """(3,) x, y, and height above the floor."""
    pan_deg: float
    tilt_deg: float
    wedge_m: FloatArray
    """(N, 2) outline of its field of view, the camera first."""
    color: Color
    on: str
    """Kind of place for a new camera; ``PRESENT`` for one that stands there."""


@dataclass(frozen=True, slots=True)
class Frame:
    """The part of the sheet that shows the room."""

    left_mm: float
    top_mm: float
    right_mm: float
    bottom_mm: float
    scale: int
    """1 m in the room is 1000 / ``scale`` mm on paper."""
    middle_m: FloatArray
    """(2,) place in the middle of the frame."""

    def on_paper(self, points_m: FloatArray) -> FloatArray:
        """Return (..., 2) millimetres of (..., 2) places, y upwards in the room."""
        middle = 0.5 * np.array([self.left_mm + self.right_mm, self.top_mm + self.bottom_mm])
        return middle + 1000.0 / self.scale * (points_m - self.middle_m) * (1.0, -1.0)

    @property
    def low_m(self) -> FloatArray:
        """(2,) place at the lower left corner."""
        return self.middle_m - 0.5 * self._size_m

    @property
    def high_m(self) -> FloatArray:
        """(2,) place at the upper right corner."""
        return self.middle_m + 0.5 * self._size_m

    @property
    def _size_m(self) -> FloatArray:
        size_mm = np.array([self.right_mm - self.left_mm, self.bottom_mm - self.top_mm])
        return size_mm * self.scale / 1000.0


def floor_plan(planned: RigPlan) -> Paper:
    """Draw room, present cameras, planned cameras and sink, with a table of the cameras' positions."""
    cameras = [*_new(planned), *_present(planned)]
    prints = footprint(planned.seen)
    rings_m = (*prints.floor_m, *prints.things_m, *planned.delivery.walls_m)
    around_m = np.vstack([*rings_m, *(camera.place_m[None, :2] for camera in cameras)])
    sink_m = np.array(planned.delivery.sink_m)
    near = np.all((sink_m > around_m.min(axis=0) - FAR_SINK_M) & (sink_m < around_m.max(axis=0) + FAR_SINK_M))
    if near:
        around_m = np.vstack([around_m, sink_m])
    name, size_mm, frame = _fitted(around_m)
    shapes: list[Shape] = [*_grid(frame)]
    for rings, fill in ((prints.floor_m, FLOOR), (prints.things_m, THINGS)):
        if rings:
            shapes.append(Area(tuple(map(frame.on_paper, rings)), fill, 1.0, WALL, 0.1))
    shapes += [Line(frame.on_paper(ends), WALL, 0.9) for ends in planned.delivery.walls_m]
    shapes += [
        Area((frame.on_paper(_within(camera.wedge_m, frame)),), camera.color, 0.1, camera.color, 0.15)
        for camera in cameras
    ]
    labels = Labels(frame.left_mm, frame.top_mm, frame.right_mm, frame.bottom_mm)
    shapes += [*_axes(frame), *_sink(sink_m, bool(near), frame, labels), *_marks(cameras, frame, labels)]
    shapes += _head(planned, name, frame.scale)
    left_mm = size_mm[0] - MARGIN_MM - TABLE_MM
    rows = [_row(camera) for camera in cameras]
    table_shapes, bottom_mm = table(rows, len(planned.plan.cameras), sink_m, left_mm, frame.top_mm)
    shapes += table_shapes
    shapes += legend(_meanings(planned), frame.scale, left_mm, bottom_mm)
    return Paper(_title(planned), *size_mm, tuple(shapes))


def _meanings(planned: RigPlan) -> list[tuple[str, Color]]:
    material = planned.radio.walls
    return [
        ("measured floor", FLOOR),
        (f"measured furniture and walls, up to {TALLEST_M:g} m high", THINGS),
        (f"straight wall; {material} takes {DAMPING_DB[material]:g} dB from a radio link across it", WALL),
        (f"new camera, its number and the first {WEDGE_M:g} m of its view", DELIVERED),
        ("present camera", TARGET),
        ("sink", LOSS),
    ]


def _new(planned: RigPlan) -> Iterator[DrawnCamera]:
    for number, camera in enumerate(planned.plan.cameras, 1):
        T = camera.T_world_camera
        view_m = wedge_m(T, planned.plan.sensor.intrinsics, WEDGE_M)
        place_m = _place_m(planned, T)
        yield DrawnCamera(str(number), place_m, *aim_deg(T), view_m, DELIVERED, STANDS_ON[camera.where])


def _present(planned: RigPlan) -> Iterator[DrawnCamera]:
    for frame in planned.rig.frames:
        T = frame.T_world_camera
        view_m = wedge_m(T, frame.intrinsics, WEDGE_M)
        yield DrawnCamera(frame.name, _place_m(planned, T), *aim_deg(T), view_m, TARGET, PRESENT)


def _place_m(planned: RigPlan, T_world_camera: FloatArray) -> FloatArray:
    return T_world_camera[:3, 3] - (0.0, 0.0, floor_m(planned.seen))


def _fitted(points_m: FloatArray) -> tuple[str, tuple[float, float], Frame]:
    """Return the paper's name and size, and the frame, at the largest scale at which the points fit."""
    low_m, high_m = points_m.min(axis=0) - AROUND_M, points_m.max(axis=0) + AROUND_M
    for name, size_mm, scale in _papers():
        right_mm = size_mm[0] - MARGIN_MM - TABLE_MM - 5.0
        corners_mm = MARGIN_MM + AXES_MM, MARGIN_MM + HEAD_MM, right_mm, size_mm[1] - MARGIN_MM - AXES_MM
        frame = Frame(*corners_mm, scale, 0.5 * (low_m + high_m))
        if np.all(frame.low_m <= low_m) and np.all(frame.high_m >= high_m):
            return name, size_mm, frame
    raise AssertionError  # _papers never ends, and at some scale every room fits


def _papers() -> Iterator[tuple[str, tuple[float, float], int]]:
    """Yield papers and scales, the preferred ones first: A3 for rooms that do not fit on A4 at 1 : 50."""
    for scale in (20, 25, 30, 40, 50):
        yield "A4", A4_MM, scale
    yield "A3", A3_MM, 50
    for power in count(2):
        for first in (1, 2, 5):
            yield "A4", A4_MM, first * 10**power
            yield "A3", A3_MM, first * 10**power


def _within(points_m: FloatArray, frame: Frame) -> FloatArray:
    """Shorten the ways from the first of (N, 2) points to the others so that they end in the frame."""
    ways_m = points_m - points_m[0]
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.where(ways_m > 0.0, frame.high_m - points_m[0], frame.low_m - points_m[0]) / ways_m
    share = np.clip(np.nanmin(np.where(ways_m == 0.0, np.inf, room), axis=1), 0.0, 1.0)
    return points_m[0] + ways_m * share[:, None]


def _step_m(frame: Frame) -> float:
    """Return the distance of two numbers on the axes: .5, 1, 2 or 5 times a power of ten."""
    steps = (first * 10.0**power for power in count(-1) for first in (1, 2, 5))
    return next(step for step in steps if step * 1000.0 / frame.scale >= TICK_MM)


def _ticks(frame: Frame) -> Iterator[tuple[int, float, FloatArray]]:
    """Yield axis, coordinate and both ends, on paper, of each line of the grid."""
    step_m = _step_m(frame)
    for axis in (0, 1):
        first, last = np.ceil(frame.low_m[axis] / step_m), np.floor(frame.high_m[axis] / step_m)
        for at_m in (step_m * np.arange(first, last + 1)).tolist():
            ends_m = np.array([frame.low_m, frame.high_m])
            ends_m[:, axis] = at_m
            yield axis, at_m, frame.on_paper(ends_m)


def _grid(frame: Frame) -> Iterator[Shape]:
    for _, _, ends_mm in _ticks(frame):
        yield Line(ends_mm, GRID, 0.1)


def _axes(frame: Frame) -> Iterator[Shape]:
    corners_mm = box(frame.left_mm, frame.top_mm, frame.right_mm, frame.bottom_mm)
    yield Line(np.vstack([corners_mm, corners_mm[:1]]), INK, 0.25)
    for axis, at_m, ends_mm in _ticks(frame):
        x_mm, y_mm = ends_mm[0]
        number = f"{at_m + 0.0:g}" if abs(at_m) > 1e-9 else "0"
        if axis == 0:
            yield Words(x_mm, frame.bottom_mm + 3.8, number, 2.6, INK, "middle")
        else:
            yield Words(frame.left_mm - 1.2, y_mm + 0.9, number, 2.6, INK, "end")
    yield Words(frame.right_mm, frame.bottom_mm + 7.6, "x (m)", 2.8, INK, "end")
    yield Words(frame.left_mm - 1.2, frame.top_mm - 1.2, "y (m)", 2.8, INK, "end")


def _sink(sink_m: FloatArray, near: bool, frame: Frame, labels: Labels) -> Iterator[Shape]:
    """Yield the sink's mark, or an arrow at the frame that points to it."""
    if near:
        x_mm, y_mm = frame.on_paper(sink_m)
        yield Area((box(x_mm - 1.8, y_mm - 1.8, x_mm + 1.8, y_mm + 1.8),), LOSS)
        yield from labels.beside(x_mm, y_mm, 2.5, "sink", 3.0, LOSS)
        return
    way_m = sink_m - frame.middle_m
    edge_m = _within(np.array([frame.middle_m, sink_m]), frame)[1]
    ahead = way_m / np.linalg.norm(way_m) * (1.0, -1.0)
    across = np.array([-ahead[1], ahead[0]])
    tip_mm = frame.on_paper(edge_m) - ahead
    back_mm, tail_mm = tip_mm - 4.0 * ahead, tip_mm - 9.0 * ahead
    yield Line(np.array([tail_mm, back_mm]), LOSS, 0.8)
    yield Area((np.array([tip_mm, back_mm + 1.7 * across, back_mm - 1.7 * across]),), LOSS)
    away_m = float(np.linalg.norm(sink_m - edge_m))
    x_mm, y_mm = tail_mm
    yield from labels.beside(x_mm, y_mm, 2.0, f"to the sink, {away_m:.1f} m beyond the frame", 3.0, LOSS)


def _marks(cameras: Sequence[DrawnCamera], frame: Frame, labels: Labels) -> Iterator[Shape]:
    """Yield each camera's mark and label: a numbered disc for a new one, a triangle for a present one."""
    places_mm = [frame.on_paper(camera.place_m[:2]) for camera in cameras]
    for camera, (x_mm, y_mm) in zip(cameras, places_mm, strict=True):
        right, down = np.cos(np.radians(camera.pan_deg)), -np.sin(np.radians(camera.pan_deg))
        for ahead_mm, radius_mm in ((0.0, 3.0), (0.5 * AIM_MM, 1.5), (AIM_MM, 1.0)):
            labels.keep_free(x_mm + ahead_mm * right, y_mm + ahead_mm * down, radius_mm)
    for camera, (x_mm, y_mm) in zip(cameras, places_mm, strict=True):
        angle = np.radians(camera.pan_deg)
        ahead = np.array([np.cos(angle), -np.sin(angle)])
        across = np.array([-ahead[1], ahead[0]])
        at_mm = np.array([x_mm, y_mm])
        if camera.on == PRESENT:
            corners_mm = [at_mm, at_mm + 3.6 * ahead + 2.0 * across, at_mm + 3.6 * ahead - 2.0 * across]
            yield Area((np.array(corners_mm),), camera.color)
            yield from labels.beside(x_mm, y_mm, 3.0, camera.name, 2.8, camera.color)
            continue
        yield Line(np.array([at_mm, at_mm + AIM_MM * ahead]), camera.color, 0.7)
        yield Area((disc(x_mm, y_mm, 2.6),), camera.color, 1.0, (255, 255, 255), 0.3)
        yield Words(x_mm, y_mm + 1.2, camera.name, 3.4, (255, 255, 255), "middle", bold=True)
        text = f"{camera.place_m[2]:.2f} m high, {camera.pan_deg:.0f}°"
        yield from labels.beside(x_mm, y_mm, 3.4, text, 2.8, INK)


def _row(camera: DrawnCamera) -> tuple[str, ...]:
    x_m, y_m, height_m = camera.place_m
    places = (f"{value + 0.0:.2f}" for value in (x_m, y_m, height_m))
    return camera.name, *places, f"{camera.pan_deg:.0f}°", f"{camera.tilt_deg:.0f}°", camera.on


def _head(planned: RigPlan, paper: str, scale: int) -> Iterator[Shape]:
    sensor = planned.plan.sensor.name.replace(AS_PRESENT, "as the present ones")
    yield Words(MARGIN_MM, MARGIN_MM + 5.0, _title(planned), 5.0, INK, bold=True)
    note = f"Sensor: {sensor}. Scale 1 : {scale} on {paper}; print at 100 % and measure the bar on the right."
    yield Words(MARGIN_MM, MARGIN_MM + 10.5, note, 3.2, INK)


def _title(planned: RigPlan) -> str:
    cameras = len(planned.plan.cameras)
    next_ones = "the next camera stands" if cameras == 1 else f"the next {cameras} cameras stand"
    return f"{planned.rig.name}: where {next_ones}"

"""Answers to requests of the measuring tool; computed in another process."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from app.compute.cuts import Cut, kept, kept_on_ray
from app.compute.measures import (
    Click,
    Clicked,
    End,
    Face,
    Made,
    MeasureAnswer,
    MeasureRequest,
    Place,
    Quantity,
    Scale,
    ScaleView,
    Taken,
)
from app.drawing.picking import picked_hole
from app.measuring.kinds import Step, steps_of
from app.measuring.survey import Survey, survey_of
from packetmesh.errors import InputError
from pipeline.measuring.lookup import lookup_of
from pipeline.measuring.marks import Mark, mark_on_ray
from pipeline.measuring.measures import (
    Measure,
    angle,
    angle_of_planes,
    box_of_part,
    box_of_planes,
    declared,
    distance,
    hole_area,
    plane_to_plane,
    point_to_plane,
)
from pipeline.measuring.planes import Plane, rectangle
from pipeline.measuring.surface import MeasuredSurface
from pipeline.types import FloatArray

CUT_OFF = "Only what Look cuts away is under the pointer; click on the surface, or set Cut away to Nothing"
NO_SURFACE = "There is nothing to measure; choose a scene with measured depth"
NO_HOLE = "There is no hole at the click; click a red rim, or into a hole"
EXTENT = (2.0, 98.0)
"""Percentiles of a plane's vertices between which it is drawn."""
NO_PART = "The node that was clicked is not in this scene"


@dataclass(frozen=True, slots=True)
class _Loop:
    """A hole's loop as ``picked_hole`` takes it."""

    loop_m: FloatArray
    rim: bool = False


def answer(surfaces: Sequence[MeasuredSurface], request: MeasureRequest) -> MeasureAnswer:
    """Turn clicks into points, and compute the requested measures and those that the clicks complete.

    Args:
        surfaces: the surfaces that can be clicked; a measure has all its points on one of them.
        request: measures and clicks. For what cannot be measured, the answer has the reason.
    """
    surveys = [survey_of(surface) for surface in surfaces]
    if not request.clicks:
        for surface in surfaces:
            lookup_of(surface).prepare()
    pending, completed, missed = request.pending, list[Taken](), ""
    for click in request.clicks:
        try:
            pending, missed = _with_click(surveys, pending, click), ""
        except InputError as error:
            missed = str(error)
        if len(pending.points_m) == len(steps_of(pending.kind, pending.snap)):
            completed.append(Taken(pending.kind, pending.snap, pending.points_m, pending.part))
            pending = Clicked(pending.kind, pending.snap)
    scaled, scale = (surveys, None) if request.scale is None else _scaled(surveys, request.scale)
    checked = None if request.check is None else _scaled(scaled, request.check)[1]
    wanted = dict.fromkeys((*request.wanted, *completed))
    set_by = request.scale if scale is not None and not scale.trouble else None
    true_m = {} if set_by is None else {set_by.by: set_by.true_m}
    return MeasureAnswer(
        request,
        tuple((taken, _made(scaled, taken, true_m.get(taken))) for taken in wanted),
        tuple(completed),
        pending,
        _pending_ends(surveys, pending),
        missed,
        scale,
        checked,
        scaled[0].surface.scale_source if scaled else "",
    )


def _with_click(surveys: Sequence[Survey], pending: Clicked, click: Click) -> Clicked:
    """Return the pending points with one more.

    Raises:
        InputError: the click meets nothing that can be marked.
    """
    step = steps_of(pending.kind, pending.snap)[len(pending.points_m)]
    part, place = _hit(surveys, pending, step, click)
    if step.marks == "plane":
        surveys[part].plane(place)
    elif step.marks == "point":
        surveys[part].mark(place, pending.snap)
    return replace(pending, points_m=(*pending.points_m, place), part=part)


def _hit(surveys: Sequence[Survey], pending: Clicked, step: Step, click: Click) -> tuple[int, Place]:
    """Return the index of the nearest surface that a click meets, and the point there, metres.

    Later clicks of a measure stay on the surface of the first.

    Raises:
        InputError: the click meets no surface.
    """
    origin_m, direction = np.array(click.origin_m), np.array(click.direction)
    found: Callable[..., FloatArray] = _rim_on_ray if step.marks == "rim" else _point_on_ray
    parts = [pending.part] if pending.points_m else range(len(surveys))
    hits = list[tuple[float, int, FloatArray]]()
    trouble = InputError(NO_SURFACE)
    for part in parts:
        try:
            point_m = found(surveys[part].surface, origin_m, direction, click.cut)
            hits.append((float(np.linalg.norm(point_m - origin_m)), part, point_m))
        except InputError as error:
            trouble = error
    if not hits:
        raise trouble
    _, part, point_m = min(hits, key=lambda hit: hit[:2])
    x_m, y_m, z_m = np.round(point_m, 3).tolist()
    return part, (x_m, y_m, z_m)


def _point_on_ray(
    surface: MeasuredSurface, origin_m: FloatArray, direction: FloatArray, cut: Cut
) -> FloatArray:
    """Return (3,) the first point of the surface on a ray that the cut keeps.

    Raises:
        InputError: there is none.
    """
    mark_on_ray(surface, origin_m, direction)  # raises if the ray meets no surface at all
    for begin, end in kept_on_ray(cut, origin_m, direction):
        spot = lookup_of(surface).first_on(origin_m + begin * direction, direction)
        if spot is not None and (spot.point_m - origin_m) @ direction <= end * (direction @ direction):
            return spot.point_m
    raise InputError(CUT_OFF)


def _rim_on_ray(
    surface: MeasuredSurface, origin_m: FloatArray, direction: FloatArray, cut: Cut
) -> FloatArray:
    """Return (3,) the kept vertex of the selected hole's rim that a ray passes at the smallest angle.

    Raises:
        InputError: the ray selects no hole.
    """
    loops = [_Loop(surface.vertices_m[hole.loop]) for hole in lookup_of(surface).open_holes]
    picked = picked_hole(loops, origin_m, direction, cut)
    if picked is None:
        raise InputError(NO_HOLE)
    rim_m = loops[picked].loop_m
    rim_m = rim_m[kept(cut, rim_m)]
    towards = rim_m - origin_m
    cosine = towards @ direction / np.linalg.norm(towards, axis=1)
    nearest_m: FloatArray = rim_m[int(cosine.argmax())]
    return nearest_m


def _scaled(surveys: Sequence[Survey], scale: Scale) -> tuple[Sequence[Survey], ScaleView]:
    """Scale the surfaces so that a measure gets its true length. Returns them with the factor; if that fails,
    unchanged with the reason.
    """
    try:
        measured = _measured(surveys[scale.by.part], scale.by)[0]
        found = [survey.scaled(scale.true_m, measured) for survey in surveys]
    except IndexError:
        return surveys, ScaleView(trouble=NO_PART)
    except InputError as error:
        return surveys, ScaleView(trouble=str(error))
    check = found[scale.by.part][1]
    return [survey for survey, _ in found], ScaleView(
        check.factor, check.ratio, check.agrees, advice=check.advice
    )


def _made(surveys: Sequence[Survey], taken: Taken, true_m: float | None = None) -> Made:
    """Return a measure's numbers, and its drawing at the size of the drawn surface.

    Args:
        surveys: the surfaces.
        taken: the measure.
        true_m: the length that it is given, if it set the scale.
    """
    try:
        survey = surveys[taken.part]
        measure, marks, planes = _measured(survey, taken)
    except IndexError:
        return Made(trouble=NO_PART)
    except InputError as error:
        return Made(trouble=str(error))
    if true_m is not None:
        measure = declared(measure, true_m)
    quantities = tuple(
        Quantity(one.name, one.value, one.unit, *one.ci95, one.guessed) for one in measure.values
    )
    ends = tuple(_end(one, survey.factor) for one in marks)
    faces = tuple(_face(survey, one) for one in planes)
    return Made(quantities, measure.ends_m / survey.factor, ends, faces)


def _measured(survey: Survey, taken: Taken) -> tuple[Measure, list[Mark], list[Plane]]:
    """Return a measure with its marks and planes.

    Raises:
        InputError: the surface has no point or plane there, or these give no measure.
    """
    marks, planes = list[Mark](), list[Plane]()
    for step, place in zip(steps_of(taken.kind, taken.snap), taken.points_m, strict=True):
        if step.marks == "point":
            marks.append(survey.mark(place, taken.snap))
        elif step.marks == "plane":
            planes.append(survey.plane(place))
    point_m = survey.factor * np.array(taken.points_m[0])
    return _combined(survey.surface, taken, marks, planes, point_m), marks, planes


def _combined(
    surface: MeasuredSurface, taken: Taken, marks: list[Mark], planes: list[Plane], point_m: FloatArray
) -> Measure:
    if taken.kind == "distance":
        return distance(surface, *marks)
    if taken.kind == "point-plane":
        return point_to_plane(surface, marks[0], planes[0])
    if taken.kind == "plane-plane":
        return plane_to_plane(surface, *planes)
    if taken.kind == "angle":
        return angle_of_planes(surface, *planes) if planes else angle(surface, *marks)
    if taken.kind == "hole":
        return hole_area(surface, point_m)
    if planes:
        first, second, third = planes
        return box_of_planes(surface, (first, second, third))
    return box_of_part(surface, point_m)


def _pending_ends(surveys: Sequence[Survey], pending: Clicked) -> tuple[End, ...]:
    """Return the ends to draw for the points clicked so far."""
    ends = list[End]()
    for step, place in zip(steps_of(pending.kind, pending.snap), pending.points_m, strict=False):
        snap = pending.snap if step.marks == "point" else "surface"
        ends.append(_end(surveys[pending.part].mark(place, snap), 1.0))
    return tuple(ends)


def _end(one: Mark, factor: float) -> End:
    return End(one.point_m / factor, one.normal, one.guessed)


def _face(survey: Survey, plane: Plane) -> Face:
    """Return a rectangle around nearly all of the part of the surface to which a plane was fitted."""
    from_middle = (survey.surface.vertices_m[plane.rows] - plane.point_m) @ plane.axes.T
    turned, (left, low), (right, high) = rectangle(from_middle, EXTENT)
    corners = np.array([[left, low], [right, low], [right, high], [left, high]]) @ turned
    return Face((plane.point_m + corners @ plane.axes) / survey.factor, plane.normal, plane.guessed)

"""The report of a plan: its promise, the floor plan, what each camera would see, and its image by radio."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from app.drawing.colors import DELIVERED, INFERRED, LOSS, css
from app.drawing.quantities import STANDS_ON
from app.reports.floor_plan import floor_plan
from app.reports.html import picture, pictures, table, write_page
from app.reports.paper import pdf_of, svg_of
from app.reports.plan_pictures import plan_pictures
from app.web.markup import Markup
from packetmesh.files import atomic_path
from pipeline.folders.plan import (
    DRAWING,
    PAGE,
    PRINT,
    best_sentence,
    dark_points,
    points,
    promise_sentence,
    times_sentence,
)
from pipeline.io.textures import Texture
from pipeline.kernels.geometry import aim_deg
from pipeline.planning.calls import RigPlan
from pipeline.planning.places import floor_m

COLUMNS = 2
HEADINGS = (
    "camera", "x (m)", "y (m)", "height (m)", "pan", "tilt", "on",
    "promise (points)", "of it dark", "overlap",
)  # fmt: skip
SENT_HEADINGS = ("camera", "90 % after (s)", "99 % after (s)", "energy (J)", "days on a battery")


def write_plan_report(planned: RigPlan, texture: Texture, folder: Path, notes: Sequence[str]) -> None:
    """Write plan.html, floor_plan.svg and floor_plan.pdf, each whole or not at all.

    Args:
        planned: the plan.
        texture: photographs on the surface from which it is planned.
        folder: output folder, created if it is missing.
        notes: sentences on the images and the plan, shown before everything else.

    Raises:
        InputError: the folder cannot be written.
    """
    paper = floor_plan(planned)
    drawing = svg_of(paper)
    for name, content in ((DRAWING, drawing.encode()), (PRINT, pdf_of(paper))):
        with atomic_path(folder / name) as sibling:
            sibling.write_bytes(content)
    body = Markup("").join(_sections(planned, texture, drawing, notes))
    write_page(folder / PAGE, f"PacketMesh: {paper.title}", body)


def _sections(planned: RigPlan, texture: Texture, drawing: str, notes: Sequence[str]) -> Iterator[Markup]:
    plan = planned.plan
    yield Markup("<h1>{}: the next cameras</h1>").format(planned.rig.name)
    yield Markup('<p class="lead">{}. {}.</p>').format(promise_sentence(planned), best_sentence(planned))
    for note in notes:
        yield Markup('<p class="lead"><b>{}.</b></p>').format(note.rstrip("."))
    yield Markup("<h2>Positions and promises</h2>")
    yield table(HEADINGS, position_rows(planned))
    yield Markup(
        '<p class="note">x and y are those of the world; the height is above the floor. Pan: angle from the '
        "x axis, counter-clockwise from above; tilt: above the horizon, so that a camera with a negative one "
        "looks down. Promise: hundredths of the present cameras' rays that newly meet measured surface, of "
        "each camera beyond those before it. Of it dark: points of the promise on surface that looks dark to "
        "a present sensor, where a camera of the same kind may get no depth, either. Overlap: share of its "
        "image that one present camera sees, too, by which it is registered.</p>"
    )
    yield Markup("<h2>Floor plan</h2>")
    yield Markup('<div class="wide">{}</div>').format(_inline(drawing))
    yield Markup(
        '<p class="note">To print at 100 %: <code>{}</code>; the same drawing: <code>{}</code>.</p>'
    ).format(PRINT, DRAWING)
    yield Markup("<h2>What the cameras would see</h2>")
    yield Markup(
        '<p class="note">From the planned places, on the surface of the present cameras: {}</p>'
    ).format(_legend())
    shown = zip(plan.cameras, plan_pictures(planned.seen, plan, texture), strict=True)
    figures = (
        picture(rgb, f"camera {number}: {points(camera.promise)} points, beyond those before it")
        for number, (camera, rgb) in enumerate(shown, 1)
    )
    yield pictures(figures, columns=min(COLUMNS, len(plan.cameras)))
    yield from _sent(planned)


def position_rows(planned: RigPlan) -> list[tuple[str, ...]]:
    """Return name, position, aim, place, promise and overlap of each camera as text."""
    ground_m = floor_m(planned.seen)
    rows = []
    for number, camera in enumerate(planned.plan.cameras, 1):
        x_m, y_m, z_m = camera.T_world_camera[:3, 3]
        pan_deg, tilt_deg = aim_deg(camera.T_world_camera)
        rows.append(
            (
                str(number),
                *(f"{value + 0.0:.2f}" for value in (x_m, y_m, z_m - ground_m)),
                f"{pan_deg:.0f}°",
                f"{tilt_deg:.0f}°",
                STANDS_ON[camera.where],
                points(camera.promise),
                dark_points(camera.promise),
                f"{camera.overlap_share:.0%}",
            )
        )
    return rows


def sent_rows(planned: RigPlan) -> list[tuple[str, ...]]:
    """Return name, times, energy and battery days of each camera as text."""
    return [
        (
            str(number),
            *(f"{value:.2f}" for value in (one.seconds_to_90_s, one.seconds_to_99_s, one.joules)),
            f"{one.battery_days:.1f}",
        )
        for number, one in enumerate(planned.delivery.cameras, 1)
    ]


def _sent(planned: RigPlan) -> Iterator[Markup]:
    radio, delivery = planned.radio, planned.delivery
    yield Markup("<h2>Their images by radio</h2>")
    yield table(SENT_HEADINGS, sent_rows(planned))
    walls = len(delivery.walls_m)
    yield Markup(
        '<p class="note">{}. Walls of {} that damp the links: {}, found in the surface. Energy is that of '
        "radio and platform until 99 % have arrived; the battery sends an image every {:g} s and sleeps in "
        "between. All new cameras together: {:.1f} J.</p>"
    ).format(times_sentence(planned), radio.walls, walls, radio.every_s, delivery.joules)


def _inline(drawing: str) -> Markup:
    """Return the drawing as wide as the page allows; its texts are escaped by ``svg_of``."""
    return Markup(drawing.replace("<svg ", '<svg class="chart" ', 1))  # noqa: S704


def _legend() -> Markup:
    """Return the meanings of the pictures' colours."""
    meanings = (
        (INFERRED, "guessed surface"),
        (LOSS, "no surface known"),
        (DELIVERED, "newly measured, the stronger the likelier"),
    )
    patches = (
        Markup('<b style="color: {}">■</b> {}').format(css(color), meaning) for color, meaning in meanings
    )
    return Markup("photographs on measured surface, {}.").format(Markup(", ").join(patches))

"""Jobs that export surfaces as shown: a page, a flight along the cameras, a picture of the view."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation, Slerp

from app.compute.records import Shown
from app.compute.state import Spec
from app.compute.store import Store
from app.drawing.colors import LOSS
from app.drawing.meshes import VIOLET
from app.drawing.pictures import opaque
from app.measuring.results import measures_of
from app.reports.captioned import captioned, gif, on_background, png
from app.reports.hand_out import viewpoint_of
from app.reports.measures import measured_sentence
from app.reports.surface_page import Side, SurfacePage, surface_page
from app.screens.surface.labels import NAMES, legend_of
from app.screens.surface.paint_job import colored_glb, vertex_colors
from app.screens.surface.view import Coloring
from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.kernels.geometry import rigid, scaled
from pipeline.kernels.rays import Camera
from pipeline.placement.outcome import Placement
from pipeline.stages import cameras_of, dressed
from pipeline.surface.pictures import beside, mesh_picture
from pipeline.types import ByteArray, PointSource, Rig, Surface, SurfaceResult

PICTURE_WIDTH_PX = 480
MOST_PICTURES, LEG_PICTURES, LEAST_LEG_PICTURES = 32, 16, 2
"""Most pictures of the way there before its last one, and most and fewest of one leg between cameras; the way
back repeats them."""
PICTURE_MS, REST_MS = 120, 800
"""Display time of a picture, and of one at an end of the flight."""
SWING_DEG = 15.0
"""Swing of a single camera to each side."""


def page_job(store: Store, spec: Spec, coloring: Coloring) -> Generator[Progress, None, bytes]:
    """Return a page with the surfaces before and after fusion or, for a baseline, the ball's and that one.

    Raises:
        InputError: neither surface has a triangle.
    """
    left, right = _pair(spec.shown)
    one, other, rig, placement = yield from store.stages(spec, left, right, "rig", "placement")
    _check(one, other)
    measured = measured_sentence((yield from measures_of(store, spec))) if spec.tape.taken else ""
    yield Progress("writing the page", 0.8)
    points_m = np.vstack([surface.vertices_m for surface in (one, other)])
    cameras = cameras_of(rig, placement)
    page = SurfacePage(
        title=rig.name,
        sentence=f"{sentence_of(rig)} {measured}".rstrip(),
        left=_side(left, one, coloring, rig, placement),
        right=_side(right, other, coloring, rig, placement),
        view=viewpoint_of([camera.T_world_camera for camera in cameras], points_m),
        legend=legend_of(coloring, rig.truth is not None),
    )
    return surface_page(page).encode()


def flight_job(store: Store, spec: Spec, coloring: Coloring) -> Generator[Progress, None, bytes]:
    """Return a flight from camera to camera and back along the surface shown, as a GIF.

    Raises:
        InputError: the surface has no triangle.
    """
    surface, rig, placement = yield from store.stages(spec, spec.shown, "rig", "placement")
    _check(surface)
    cameras, legend = cameras_of(rig, placement), legend_of(coloring, rig.truth is not None)
    picture = _painter(surface, coloring, rig, placement)
    there: list[Image.Image] = []
    way = list(flight(cameras, surface))
    for done, camera in enumerate(way):
        yield Progress(f"picture {done + 1} of {len(way)}", 0.1 + 0.8 * done / len(way))
        there.append(captioned(picture(camera), rig.name, NAMES[spec.shown], legend))
    stays_ms = [REST_MS, *[PICTURE_MS] * (len(there) - 2), REST_MS]
    yield Progress("writing the animation", 0.95)
    return gif([*there, *there[-2:0:-1]], [*stays_ms, *stays_ms[-2:0:-1]])


def view_job(
    store: Store, spec: Spec, coloring: Coloring, rims: bool, rgba: ByteArray
) -> Generator[Progress, None, bytes]:
    """Return the browser's picture (H, W, 4) on the app's background, with title and legend, as PNG."""
    (rig,) = yield from store.stages(spec, "rig")
    legend = legend_of(coloring, rig.truth is not None)
    if rims and legend.bar is None:
        legend = replace(legend, swatches=(*legend.swatches, ("rims of holes", LOSS)))
    return png(captioned(opaque(rgba), rig.name, NAMES[spec.shown], legend))


def _pair(shown: Shown) -> tuple[Shown, Shown]:
    """Return the surfaces to the left and to the right of the line."""
    return ("before", "after") if shown in ("before", "after") else ("after", shown)


def _check(*surfaces: Surface) -> None:
    if not any(len(surface.triangles) for surface in surfaces):
        raise InputError("The surface has no triangle to show; try a larger ball radius")


def sentence_of(rig: Rig) -> str:
    """Return a sentence on the cameras of a surface, for its page."""
    nodes = "one camera node" if len(rig.frames) == 1 else f"{len(rig.frames)} camera nodes"
    source = nodes if rig.walk is None else "one walking camera"
    return f"A surface made from the images of {source}. Drag the line to compare."


def _side(name: Shown, surface: SurfaceResult, coloring: Coloring, rig: Rig, placement: Placement) -> Side:
    note = f"{100 * surface.quality.no_hit_ray_share:.1f} % of the cameras' rays are without a surface"
    return Side(NAMES[name], note, colored_glb(surface, coloring, rig, placement))


def _painter(
    surface: Surface, coloring: Coloring, rig: Rig, placement: Placement
) -> Callable[[Camera], ByteArray]:
    """Return a function that draws the surface in its colours from any camera."""
    colors = vertex_colors(surface, coloring, rig, cameras_of(rig, placement))
    painted = replace(surface, colors=colors)
    texture = dressed(rig, placement, surface) if coloring in ("photo", "violet") else None
    guessed = coloring == "violet" and surface.source is not None
    marks = np.where(surface.source == PointSource.INFERRED, 255, 0) if guessed else np.zeros(0)
    marked = replace(surface, colors=np.repeat(marks[:, None], 3, axis=1).astype(np.uint8))

    def picture(camera: Camera) -> ByteArray:
        seen = on_background(mesh_picture(painted, camera, texture=texture))
        if guessed:
            tinted = mesh_picture(marked, camera)[..., 1] > 64  # pixels without a hit have no green
            seen[tinted] = seen[tinted] * VIOLET
        return seen

    return picture


def flight(cameras: Sequence[Camera], surface: Surface) -> Iterator[Camera]:
    """Yield cameras from the first to the last through the others, slower near each; a single one swings.

    If there are too many, it passes evenly chosen ones.
    """
    first = cameras[0]
    K = first.intrinsics
    K = scaled(K, PICTURE_WIDTH_PX / K.width_px)
    if len(cameras) == 1:
        cameras = [beside(first, surface, -SWING_DEG), first, beside(first, surface, SWING_DEG)]
    legs = min(len(cameras) - 1, MOST_PICTURES // LEAST_LEG_PICTURES)
    cameras = [cameras[row] for row in np.linspace(0, len(cameras) - 1, legs + 1).round().astype(int)]
    count = min(LEG_PICTURES, MOST_PICTURES // legs)
    shares = np.linspace(0.0, 1.0, count, endpoint=False)
    for one, other in pairwise(camera.T_world_camera for camera in cameras):
        turn = Slerp([0.0, 1.0], Rotation.from_matrix([one[:3, :3], other[:3, :3]]))
        for share in (0.5 - 0.5 * np.cos(np.pi * shares)).tolist():
            place_m = (1.0 - share) * one[:3, 3] + share * other[:3, 3]
            yield Camera(K, rigid(turn(share).as_matrix(), place_m))
    yield Camera(K, cameras[-1].T_world_camera)

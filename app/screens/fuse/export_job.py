"""Jobs that export a race: a page that plays it, and a GIF."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np

from app.compute.state import Spec
from app.compute.store import Store
from app.drawing.colors import MOST_DISTANCE_M
from app.reports.hand_out import viewpoint_of
from app.reports.race import RaceRun, RaceShow, race_page
from app.reports.race_animation import race_animation
from app.screens.fuse.labels import MODES, OFF_FROM
from app.screens.fuse.methods import color_of
from app.screens.fuse.numbers import off_text, winner
from app.screens.fuse.race_job import race_job
from app.screens.fuse.view import SUCCESS_M, Race, RaceLane, RaceView
from packetmesh.progress import Progress
from pipeline.kernels.geometry import apply
from pipeline.types import Rig


def page_job(store: Store, spec: Spec, race: Race) -> Generator[Progress, None, bytes]:
    """Return a page that plays the race."""
    show = yield from _show(store, spec, race)
    return race_page(show).encode()


def animation_job(store: Store, spec: Spec, race: Race) -> Generator[Progress, None, bytes]:
    """Return the race as a GIF."""
    show = yield from _show(store, spec, race)
    yield Progress("drawing the race", 0.7)
    return race_animation(show)


def _show(store: Store, spec: Spec, race: Race) -> Generator[Progress, None, RaceShow]:
    (rig,) = yield from store.stages(spec, "rig")
    view = yield from race_job(store, spec, race)
    return race_show(view, _title(rig, race))


def _title(rig: Rig, race: Race) -> str:
    names = [frame.name for frame in rig.frames]
    if race.mode == "nodes":
        return f"{rig.name}: {names[race.source]} onto {names[race.target]}"
    if race.mode == "inferred":
        return f"{rig.name}: the inferred cloud of {names[race.source]} onto what its sensor measured"
    room = next(name for name, mode in MODES.items() if mode == race.mode)
    return f"{room}: one scan onto the other"


def race_show(view: RaceView, title: str) -> RaceShow:
    """Return the data of a race's exported page and GIF."""
    T = view.T_world_target
    target_m = apply(T, view.target.points_m.astype(float))
    start_m = apply(T @ view.lanes[0].steps[0].T_target_source, view.source.points_m.astype(float))
    seen_m = np.vstack([target_m, start_m])
    low_m, high_m = np.percentile(seen_m, [1, 99], axis=0)
    inside = np.all((seen_m >= low_m) & (seen_m <= high_m), axis=1)
    what = f"Distance {OFF_FROM[view.reference]}"
    return RaceShow(
        title=title,
        sentence=winner(view.reference, view.lanes).replace("**", "").unescape(),
        source_m=view.source.points_m,
        target_m=target_m,
        view=viewpoint_of([T], seen_m[inside], cameras_in_sight=False),
        runs=tuple(_run(lane, view) for lane in view.lanes),
        lens_target=None if view.lens is None else view.lens.target,
        lens_cm=0.0 if view.lens is None else 100.0 * view.lens.window_m,
        scale=(what, "0", f"{100.0 * MOST_DISTANCE_M:.0f} cm and more"),
    )


def _run(lane: RaceLane, view: RaceView) -> RaceRun:
    last = lane.steps[-1]
    arrived = None if last.point_error_m is None else last.point_error_m < SUCCESS_M
    end = "stopped" if arrived is None else "arrived" if arrived else "missed"
    notes = [f"iteration {row} of {lane.iterations}" for row in range(len(lane.steps) - 1)]
    return RaceRun(
        name=lane.label,
        color=color_of(lane.rival),
        poses=np.array([view.T_world_target @ step.T_target_source for step in lane.steps]),
        offs_cm=lane.offs_cm,
        offs=tuple(off_text(step) for step in lane.steps),
        notes=(*notes, f"{end} after {lane.iterations} iterations · {lane.verdict}"),
        arrived=arrived,
        shades=np.stack([step.shades for step in lane.steps]),
        lens=tuple(step.lens for step in lane.steps),
    )

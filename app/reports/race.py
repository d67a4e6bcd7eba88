"""A race of registrations for viewers without PacketMesh: plain values, and their page."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace

import numpy as np

from app.drawing.colors import DISTANCE_STOPS, NEUTRAL, css
from app.reports.hand_out import Viewpoint
from app.reports.offline_page import offline_page
from app.web.markup import Markup
from pipeline.io.cloud_precision import middle_m, too_coarse
from pipeline.kernels.geometry import rigid
from pipeline.types import ByteArray, FloatArray

_PARTS = ("race_page.css", "offline_page.js", "hand_out_view.js", "race_page.js")


@dataclass(frozen=True, slots=True)
class RaceRun:
    """One method's poses and errors, one step per iteration and one for its end."""

    name: str
    color: tuple[int, int, int]
    poses: FloatArray
    """(K, 4, 4) T_world_source."""
    offs_cm: FloatArray
    """(K,) error, centimetres; NaN, a gap in the curve, if it is out of reach or unknown."""
    offs: tuple[str, ...]
    """(K,) error as text; one out of reach as its lower limit."""
    notes: tuple[str, ...]
    """(K,) status texts."""
    arrived: bool | None
    """Whether it arrived at the end; None if no reference position is known."""
    shades: ByteArray
    """(K, N) distance of each point, 0 to 255 along the scale."""
    lens: tuple[ByteArray, ...]
    """(K,) arrays (M, 3): column, row and shade of the points in the magnified corner."""


@dataclass(frozen=True, slots=True)
class RaceShow:
    """A race as its page and its GIF show it."""

    title: str
    sentence: str
    source_m: FloatArray
    """(N, 3) source frame."""
    target_m: FloatArray
    """(M, 3) world frame."""
    view: Viewpoint
    runs: tuple[RaceRun, ...]
    lens_target: ByteArray | None
    """(K, 2) column and row, 0 to 255 across the corner; None without one."""
    lens_cm: float
    """Width of the corner."""
    scale: tuple[str, str, str]
    """Meaning of the moving cloud's colours, and the words at the ends of their scale."""

    @property
    def steps(self) -> int:
        """Number of steps of the longest run."""
        return max(len(run.poses) for run in self.runs)


def _near_origin(race: RaceShow) -> RaceShow:
    """Move clouds to the origin of their frames if the page's 32-bit numbers are too coarse for them."""
    source_at_m, target_at_m = (
        middle_m(points_m) if too_coarse(points_m) else np.zeros(3)
        for points_m in (race.source_m, race.target_m)
    )
    if not (source_at_m.any() or target_at_m.any()):
        return race
    T_far_near, T_near_far = rigid(np.eye(3), source_at_m), rigid(np.eye(3), -target_at_m)
    view = race.view
    return replace(
        race,
        source_m=race.source_m - source_at_m,
        target_m=race.target_m - target_at_m,
        view=replace(view, eye_m=view.eye_m - target_at_m, middle_m=view.middle_m - target_at_m),
        runs=tuple(replace(run, poses=T_near_far @ run.poses @ T_far_near) for run in race.runs),
    )


def race_page(race: RaceShow) -> Markup:
    """Return a self-contained HTML document that plays the race."""
    race = _near_origin(race)
    record = {
        "view": race.view.record(),
        "steps": race.steps,
        "scale": {
            "words": race.scale,
            "stops": [css(stop) for stop in DISTANCE_STOPS],
            "stays": css(NEUTRAL),
        },
        "lens_cm": None if race.lens_target is None else race.lens_cm,
        "runs": [
            {
                "name": run.name,
                "color": css(run.color),
                "poses": [pose.T.ravel().tolist() for pose in run.poses],
                "offs_cm": [float(off) if np.isfinite(off) else None for off in run.offs_cm],
                "offs": run.offs,
                "notes": run.notes,
                "arrived": run.arrived,
                "lens": [len(points) for points in run.lens],
            }
            for run in race.runs
        ],
    }
    places = {"source": race.source_m, "target": race.target_m}
    blocks = {name: points_m.astype("<f4").tobytes() for name, points_m in places.items()}
    if race.lens_target is not None:
        blocks["lens"] = race.lens_target.tobytes()
    for row, run in enumerate(race.runs):
        blocks[f"shades-{row}"] = run.shades.tobytes()
        blocks[f"lens-{row}"] = b"".join(points.astype(np.uint8).tobytes() for points in run.lens)
    packed = {name: zlib.compress(block) for name, block in blocks.items()}
    words = {"title": race.title, "sentence": race.sentence}
    return offline_page(f"{race.title} · PacketMesh", "race_page.html", words, _PARTS, record, packed)

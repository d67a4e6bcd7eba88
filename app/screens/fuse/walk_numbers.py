"""Sentences and tables on a walk, its frames and its loops."""

from __future__ import annotations

import base64

import numpy as np

from app.drawing.colors import css
from app.screens.fuse.walk_view import MOTIONS, LoopView, Pictures, WalkView
from app.web.markup import Markup
from app.window.tables import UNKNOWN, Row, number, table, term

LINES: tuple[tuple[str, str], ...] = (
    ("solid", "path of the camera up to the moment"),
    ("faint", "path after the moment"),
    ("dashed", "path and camera by tracking alone, without loops"),
    ("frustum", "camera at the moment, with its picture"),
    ("loop", "cameras of the chosen loop; red if it contradicts the others"),
)
"""Line style and description of each thing that is drawn besides the map."""
MAP_LINE = Markup(
    "<div><b style='margin: 0 13px 0 6px'>⁘</b>map of the frames up to the moment; grey: colour unknown</div>"
)
MOMENT = term("Moment", "The frame at the clock's time, and the part of the map measured by then.")


def walk_table(view: WalkView) -> Markup:
    """Return a table with the numbers of the whole walk."""
    rate = (view.frames - 1) / max(float(view.times_s[-1]), 1e-9)
    rows: list[Row] = [
        ("Frames", "Depth and colour images of the recording.", f"{view.frames:,} ({rate:.0f} per second)"),
        (
            "Tracked",
            "Frames whose pose is known; only they are in the map.",
            f"{view.frames - view.lost_frames:,}",
        ),
        (
            "Lost",
            "Frames without a pose: they have too little depth, or show too little of what was seen before.",
            f"{view.lost_frames:,}",
        ),
        (
            "Keyframes",
            "Frames with which the later ones are registered; a new one begins when less than 80 % of "
            "a frame is in the last one.",
            f"{len(view.keyframes):,}",
        ),
        (
            "Loops used",
            "Registrations of keyframes that show the same place again, of those found; one that "
            "contradicts the others is not used.",
            f"{view.used_loops:,} of {len(view.loops):,}",
        ),
        ("Path", "Length of the camera's path.", number(view.path_m, 2, "m")),
        (
            "Largest drift",
            "Largest distance between the position by tracking alone and the one after the loops.",
            _cm(float(np.nanmax(view.drift_m))),
        ),
        (
            "Corrected at the end",
            "The same distance at the last tracked frame.",
            _cm(view.drift_m[view.last]),
        ),
        (
            "Points in the map",
            "Points of the surface, averaged; at least two frames measured each (one, if fewer than 10 "
            "frames are tracked). A part of them is drawn.",
            f"{view.map_points:,}",
        ),
    ]
    return table(rows)


def frame_line(view: WalkView, frame: int) -> str:
    """Return a line about a frame: number, time, and whether it is a keyframe or lost."""
    line = f"Frame {frame}, {view.times_s[frame]:.2f} s"
    if np.isnan(view.drift_m[frame]):
        return f"{line}: lost, it has too little depth or shows too little of what was seen before"
    kind = "keyframe" if frame in view.keyframes else "tracked"
    return f"{line}: {kind}; tracking alone is {_cm(view.drift_m[frame])} off"


def loop_name(loop: LoopView) -> str:
    """Return the name of a loop by its keyframes: ``frames 0 and 180``."""
    return "frames {} and {}".format(*loop.frames)


def loop_line(loop: LoopView) -> str:
    """Return a line about a loop: its keyframes, how far it is from tracking, and whether it is used."""
    counts = "used" if loop.used else "not used, it contradicts the others"
    return (
        f"Loop of {loop_name(loop)}: {_cm(loop.moved_m)} and {_deg(loop.turned_rad)} from tracking; {counts}"
    )


def loop_html(view: WalkView, loop: LoopView, pictures: Pictures) -> Markup:
    """Return the pictures of a loop's two keyframes, and its numbers."""
    shown = Markup("").join(_picture(view.times_s[frame], frame, pictures.of(frame)) for frame in loop.frames)
    if loop.used:
        counts, why = "yes", "The final poses agree with it as far as the others allow."
    else:
        counts, why = "no", "A registration that contradicts most others is left out of the final poses."
    rows: list[Row] = [
        (
            "Moved",
            "Distance of the later camera, seen from the earlier one, between tracking alone and this loop.",
            f"{_cm(loop.moved_m)}, {_deg(loop.turned_rad)}",
        ),
        (
            "Left",
            "The same between the final poses and this loop: what the other registrations say against it. It "
            "is large where a registration can slide along bare walls; it has little weight there.",
            f"{_cm(loop.left_m)}, {_deg(loop.left_rad)}",
        ),
        ("Overlap", "Share of one image's points that the other shows.", _percent(loop.overlap_share)),
        ("Agreement", "Share of those points that are at the same depth.", _percent(loop.agreeing_share)),
        (
            "Fixed motions",
            "How many of the camera's three turns and three shifts this registration fixes to 1.8° and 3 cm. "
            "Along the other motions it can slide, as along a bare wall, and fits everywhere.",
            f"{loop.held} of {MOTIONS}",
        ),
        ("Counts", why, counts),
    ]
    reason = Markup("")
    if not loop.used:
        reason = Markup(
            "<div style='padding: 0 0.8em 0.8em; font-size: 13px'>Not used: by the other registrations the "
            "camera was {} and {} elsewhere.</div>"
        ).format(_cm(loop.left_m), _deg(loop.left_rad))
    return (
        Markup("<div style='display: flex; gap: 0.5em; padding: 0 0.8em 0.4em'>{}</div>").format(shown)
        + table(rows)
        + reason
    )


def moment_html(view: WalkView, frame: int, pictures: Pictures) -> Markup:
    """Return the picture of a frame and, to its right, lines about the frame and the map up to it."""
    share = view.until[frame] / max(len(view.points_m), 1)
    return Markup(
        "<div style='display: flex; gap: 0.8em; padding: 0 0.8em 0.6em; font-size: 13px'>"
        "<div style='flex: none; width: 160px'>{}</div>"
        "<div>{}<br>{}.<br>The map has {} of its points.</div></div>"
    ).format(_image(pictures.of(frame)), MOMENT, frame_line(view, frame), _percent(float(share)))


def _picture(time_s: float, frame: int, data: bytes | None) -> Markup:
    return Markup("<div style='flex: 1; font-size: 12px'>{}frame {}, {:.2f} s</div>").format(
        _image(data), frame, time_s
    )


def _image(data: bytes | None) -> Markup:
    if data is None:
        return Markup("")
    image = Markup("<img alt='' style='width: 100%; display: block' src='data:image/jpeg;base64,{}'>")
    return image.format(base64.b64encode(data).decode())


def legend_html(colors: dict[str, tuple[int, int, int]], times: int) -> Markup:
    """Return the legend of the 3-D view, a line for each thing.

    Args:
        colors: colours by the names in ``LINES``.
        times: factor by which the drift is enlarged.
    """
    strokes = {"dashed": "dashed", "frustum": "double", "loop": "double"}
    lines = [
        Markup(
            "<div><i style='display: inline-block; width: 22px; border-top: 3px {} {}; margin-right: 8px; "
            "vertical-align: 4px'></i>{}{}</div>"
        ).format(strokes.get(look, "solid"), css(colors[look]), name, _enlarged(look, times))
        for look, name in LINES
    ]
    return Markup("<div style='padding: 0 0.8em 0.8em; font-size: 12px'>{}</div>").format(
        Markup("").join([*lines, MAP_LINE])
    )


def _enlarged(look: str, times: int) -> str:
    return f"; its drift is drawn {times} times as large" if look == "dashed" and times > 1 else ""


def _cm(length_m: float) -> str:
    return number(float(length_m), 1, "cm", 100.0)


def _deg(angle_rad: float) -> str:
    return UNKNOWN if angle_rad != angle_rad else f"{np.degrees(angle_rad):.2f}°"


def _percent(share: float) -> str:
    return number(share, 0, "%", 100.0)

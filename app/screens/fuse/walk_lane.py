"""The lanes of a walk in the dock: the frames with their keyframes and loops, and the drift."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from app.drawing.colors import DELIVERED, LOSS, NEUTRAL
from app.drawing.timeline import (
    NAME_PX,
    PAPER,
    RULE,
    WORD_PX,
    Color,
    Curve,
    CurvesLane,
    Label,
    Word,
    round_up,
)
from app.screens.fuse.walk_numbers import frame_line, loop_line
from app.screens.fuse.walk_view import LoopView, WalkView
from pipeline.types import ByteArray, FloatArray

ARCS_PX, BAND_PX, DRIFT_PX = 58, 22, 44
"""Height of the loops above the frames, of the frames, and of the drift's lane."""
LEAST_ARC = 0.25
"""Height of the shortest loop over ``ARCS_PX``."""
TRACKED, KEYFRAME = (158, 199, 226), (20, 52, 82)
USED, CONTRADICTED = (112, 190, 160), LOSS
"""Colours of frames and loops; a chosen loop is drawn in ``DELIVERED``."""
ARC_PARTS, DASH_PARTS = 96, 4
"""Number of straight parts of a loop's arc, and of one of its dashes."""
NEAR_PX = 6.0
"""Largest distance of a click from a loop that it picks."""


class WalkLane:
    """The frames as a band, with a tick at each keyframe; a loop is an arc between its two keyframes."""

    title = "Frames"
    height_px = ARCS_PX + BAND_PX
    veil = 0.0
    ticks: Sequence[Label] = ()

    def __init__(self, view: WalkView, chosen: int = -1) -> None:
        """Show a walk; ``chosen`` is the index of the loop that is drawn thick, -1 for none."""
        self._view, self._chosen, self._times_ns = view, chosen, view.times_ns
        gaps_ns = np.diff(self._times_ns)
        self._ends_ns = np.append(self._times_ns[1:], self._times_ns[-1] + int(np.median(gaps_ns)))
        legend: list[tuple[str, Color]] = [("tracked frames", TRACKED), ("keyframes", KEYFRAME)]
        if view.lost:
            legend.append(("lost", LOSS))
        if view.used_loops:
            legend.append(("loops", USED))
        if view.used_loops < len(view.loops):
            legend.append(("loops that contradict (dashed)", CONTRADICTED))
        self.legend: Sequence[tuple[str, Color]] = tuple(legend)

    def draw(self, picture: ByteArray, start_ns: int, end_ns: int) -> None:
        """Draw the frames of the window and the loops over them."""
        width = picture.shape[1]
        picture[:] = PAPER
        picture[ARCS_PX - 1] = RULE
        pixels = start_ns + (2 * np.arange(width, dtype=np.int64) + 1) * (end_ns - start_ns) // (2 * width)
        at = np.searchsorted(self._times_ns, pixels, side="right") - 1
        inside = (at >= 0) & (pixels < self._ends_ns[at])
        lost = np.isnan(self._view.T_world_camera[at, 0, 0])
        picture[ARCS_PX:, inside] = TRACKED
        picture[ARCS_PX:, inside & lost] = LOSS
        scale = width / (end_ns - start_ns)
        for frame in self._view.keyframes:
            x = round((int(self._times_ns[frame]) - start_ns) * scale)
            picture[ARCS_PX:, max(x, 0) : max(x + 2, 0)] = KEYFRAME
        order = sorted(range(len(self._view.loops)), key=lambda index: index == self._chosen)
        for index in order:
            self._draw_arc(picture, index, start_ns, scale)

    def _draw_arc(self, picture: ByteArray, index: int, start_ns: int, scale: float) -> None:
        loop, chosen = self._view.loops[index], index == self._chosen
        t_ns, y_px = self._arc(loop)
        points = (16.0 * np.stack([(t_ns - start_ns) * scale, y_px], axis=1)).round().astype(np.int32)
        parts = [points]
        if not loop.used:
            parts = [points[at : at + DASH_PARTS + 1] for at in range(0, ARC_PARTS, 2 * DASH_PARTS)]
        color = CONTRADICTED if not loop.used else DELIVERED if chosen else USED
        cv2.polylines(picture, parts, False, color, 3 if chosen else 1, cv2.LINE_AA, shift=4)

    def _arc(self, loop: LoopView) -> tuple[FloatArray, FloatArray]:
        """Return (K,) times and (K,) heights from the lane's upper edge along a loop's arc."""
        first, last = (float(self._times_ns[frame]) for frame in loop.frames)
        span = (last - first) / max(float(self._times_ns[-1] - self._times_ns[0]), 1.0)
        high_px = (ARCS_PX - 4) * (LEAST_ARC + (1.0 - LEAST_ARC) * np.sqrt(span))
        angles = np.linspace(np.pi, 0.0, ARC_PARTS + 1)
        t_ns = 0.5 * (first + last) + 0.5 * (last - first) * np.cos(angles)
        return t_ns, ARCS_PX - high_px * np.sin(angles)

    def labels(self, now_ns: int) -> Sequence[Label]:
        """Return two labels: the number of loops; the number and state of the frame at the clock's time."""
        view, frame = self._view, self._view.frame_at(now_ns)
        lost = bool(np.isnan(view.T_world_camera[frame, 0, 0]))
        state = "lost" if lost else "keyframe" if frame in view.keyframes else "tracked"
        count = len(view.loops)
        loops = f"{count} loop{'s' * (count != 1)}" if count else "no loop"
        ink = LOSS if lost else KEYFRAME
        return [
            Label(0.5 * NAME_PX, loops),
            Label(ARCS_PX + 0.5 * BAND_PX, f"frame {frame}: {state}", ink),
        ]

    def words(self, start_ns: int, end_ns: int, width_px: int) -> Sequence[Word]:
        """Return a word in each lost span that is wide enough."""
        least_ns = WORD_PX * (end_ns - start_ns) / width_px
        spans = [(int(self._times_ns[first]), int(self._ends_ns[last])) for first, last in self._view.lost]
        y_px = ARCS_PX + 0.5 * BAND_PX
        return [Word(*span, y_px, "lost") for span in spans if span[1] - span[0] >= least_ns]

    def pick(self, t_ns: int, y_px: int, tolerance_ns: int) -> int:
        """Return the index of the loop nearest to a place; -1 in the band or beyond ``NEAR_PX``."""
        if y_px >= ARCS_PX or not self._view.loops:
            return -1
        arcs = [self._arc(loop) for loop in self._view.loops]
        per_ns = NEAR_PX / max(tolerance_ns, 1)
        away_px = [np.hypot((t - t_ns) * per_ns, y - y_px).min() for t, y in arcs]
        nearest = int(np.argmin(away_px))
        return nearest if away_px[nearest] <= NEAR_PX else -1

    def tip(self, t_ns: int, y_px: int, tolerance_ns: int) -> str:
        """Return a line about the loop or the frame at a place."""
        if y_px >= ARCS_PX:
            return frame_line(self._view, self._view.frame_at(t_ns))
        index = self.pick(t_ns, y_px, tolerance_ns)
        return "" if index < 0 else loop_line(self._view.loops[index])

    def place(self, item: int) -> tuple[int, int, int, int]:
        """Return the times of a loop's two keyframes, ns, and the upper and lower edge of the band, px."""
        first, last = self._view.loops[item].frames
        return int(self._times_ns[first]), int(self._times_ns[last]), ARCS_PX, self.height_px


def drift_lane(view: WalkView) -> CurvesLane:
    """Return a lane with the distance between the path by tracking alone and the final path, centimetres."""
    drift_cm = 100.0 * view.drift_m
    high_cm = round_up(max(float(np.nanmax(drift_cm)), 0.1))
    curve = Curve("drift", "cm", NEUTRAL, view.times_ns, drift_cm, 0.0, high_cm, 1)
    return CurvesLane("Drift", [curve], DRIFT_PX, veil=0.0)

"""Curves and the timeline of one run or two, with the player's place on both."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from app.drawing.colors import SOURCE, TARGET, css
from app.drawing.curves import Curves
from app.screens.network.gantt import Window, cursor_html, gantt_html, legend_html
from app.screens.network.labels import CURVES
from app.screens.network.player import RUN_S, NetworkPlayer, short_time
from app.screens.network.view import Curve, NetworkView, Series, What
from app.ui import Ui
from network_sim.types import PacketKind

RUNS = ((css(TARGET), ()), (css(SOURCE), (7, 3)))
"""Colour and dashes of the first run and of the one beside it."""
NARROWEST = -3.0
"""Power of ten of the shortest window in seconds."""
PAGE = 0.9
"""The window moves on when the player is past so much of it."""
FRAMES_SHOWN = 20
FRAMES_S = 15.0
"""How long they take to play."""


class NetworkCharts:
    """Four curves in tabs, and below them a row for each node."""

    def __init__(self, ui: Ui, player: NetworkPlayer) -> None:
        """Add the tabs, the rows of nodes and what moves their window, and the ``player`` with it."""
        gui = ui.gui
        self._curves: dict[Curve, Curves] = {}
        tabs = gui.add_tab_group()
        for curve, (title, quantity, least, hint) in CURVES.items():
            with tabs.add_tab(title):
                self._curves[curve] = Curves(gui, quantity, RUNS, least, 170)
                gui.add_html(f"<div style='padding: 0 0.8em 0.5em; font-size: 12px'>{hint}</div>")
        self._labels = gui.add_html("")
        self._player = player
        self._views: Sequence[NetworkView] = ()
        self._whole = self._window = Window(0, 1_000_000_000)
        self._now_ns = 0
        self._painted: Window | None = None
        self._zoom = gui.add_slider(
            "Span (s)",
            NARROWEST,
            0.0,
            0.05,
            0.0,
            hint="Length of the timeline below, as a power of ten of seconds; it follows the player.",
        )
        ui.when_changed(self._zoom, self._zoomed)
        actions = {
            "Earlier": lambda: self._turn(-1),
            "Later": lambda: self._turn(1),
            "Frames": self._show_frames,
            "All": self._show_all,
        }
        about = f"Move the window; go to the next {FRAMES_SHOWN} frames, in slow motion; show everything."
        ui.buttons("Timeline", actions, about)
        self._rows = [gui.add_html("") for _ in range(4)]
        self._legend = gui.add_html("")

    def load(self, views: Sequence[NetworkView]) -> None:
        """Show other runs, from their start."""
        self._views, self._painted = views, None
        start_ns, end_ns = min(view.start_ns for view in views), max(view.end_ns for view in views)
        self._whole = self._window = Window(start_ns, max(end_ns - start_ns, 1_000_000))
        self._now_ns = start_ns
        widest = round(math.log10(self._whole.span_ns / 1e9) + 0.05, 2)
        self._zoom.max = widest
        self._zoom.value = widest
        for name, curves in self._curves.items():
            self._load(curves, [view.series[name] for view in views], start_ns, end_ns)
        self._labels.content = _labels([view.label for view in views]) if len(views) > 1 else ""
        self._legend.content = legend_html(
            {PacketKind(int(kind)) for view in views for kind in set(view.pieces.carries.tolist())}
        )
        for row in self._rows[2 * len(views) :]:
            row.content = ""
        self._paint()

    def forget(self) -> None:
        """Show nothing."""
        self._views = ()
        for curves in self._curves.values():
            self._load(curves, (), 0, 1_000_000_000)
        for html in (*self._rows, self._legend, self._labels):
            html.content = ""

    @staticmethod
    def _load(curves: Curves, series: Sequence[Series], start_ns: int, end_ns: int) -> None:
        ends_s = (start_ns / 1e9, end_ns / 1e9)
        curves.load([(one.t_s, one.values) for one in series], ends_s, "simulated time, s")

    def mark(self, now_ns: int) -> None:
        """Follow the player; the window turns like a page when it is left."""
        self._now_ns = now_ns
        for curves in self._curves.values():
            curves.mark(now_ns / 1e9)
        if not 0.0 <= self._window.share(now_ns) <= PAGE and self._window != self._whole:
            self._look(now_ns - self._window.span_ns // 10, self._window.span_ns)
        self._paint()

    def _look(self, start_ns: int, span_ns: int) -> None:
        """Move the window, within the whole."""
        span_ns = min(span_ns, self._whole.span_ns)
        last_ns = self._whole.end_ns - span_ns
        self._window = Window(min(max(start_ns, self._whole.start_ns), last_ns), span_ns)

    def _zoomed(self) -> None:
        self._zoom_to(round(10.0 ** (self._zoom.value + 9.0)))

    def _zoom_to(self, span_ns: int) -> None:
        """Keep the player's place where it is in the window, if it is in it."""
        share = self._window.share(self._now_ns)
        share = share if 0.0 <= share <= 1.0 else 0.1
        self._look(round(self._now_ns - share * span_ns), span_ns)
        self._paint()

    def _turn(self, by: int) -> None:
        """Move the window by most of its length."""
        self._look(self._window.start_ns + by * round(0.8 * self._window.span_ns), self._window.span_ns)
        self._follow_window()

    def _show_all(self) -> None:
        self._window = self._whole
        self._player.pace(self._whole.span_ns / 1e9 / RUN_S)
        self._follow_window()

    def _show_frames(self) -> None:
        """Go to the next frames, in slow motion."""
        first_ns, last_ns = self._next_frames_ns()
        self._player.seek_time(first_ns)
        span_ns = max(round(1.2 * (last_ns - first_ns)), 1_000_000)
        self._player.pace(span_ns / 1e9 / FRAMES_S)
        self._look(first_ns - span_ns // 10, span_ns)
        self._follow_window()

    def _follow_window(self) -> None:
        """Have the slider and the rows show the window."""
        span_s = self._window.span_ns / 1e9
        self._zoom.value = round(min(max(math.log10(span_s), NARROWEST), self._zoom.max), 2)
        self._paint()

    def _next_frames_ns(self) -> tuple[int, int]:
        """When the next frames begin, the first and the last of them; at the end, those before it."""
        starts_ns = np.sort(
            np.concatenate([view.pieces.start_ns[view.pieces.what == What.AIR] for view in self._views])
        )
        if not len(starts_ns):
            return self._now_ns, self._now_ns
        first = min(int(np.searchsorted(starts_ns, self._now_ns)), max(len(starts_ns) - FRAMES_SHOWN, 0))
        return int(starts_ns[first]), int(starts_ns[first : first + FRAMES_SHOWN][-1])

    def _paint(self) -> None:
        """Paint the rows if the window has moved, and the player's place."""
        several = len(self._views) > 1
        moved, self._painted = self._painted != self._window, self._window
        self._zoom.label = f"Span ({short_time(self._window.span_ns / 1e9)})"
        for index, view in enumerate(self._views):
            rows, cursor = self._rows[2 * index : 2 * index + 2]
            if moved:
                rows.content = gantt_html(view, self._window, view.label if several else "")
            cursor.content = cursor_html(view, self._window, self._now_ns)


def _labels(labels: Sequence[str]) -> str:
    """The runs in the colours of their curves."""
    words = " &emsp; ".join(
        f"<b style='color: {color}'>{'―' if index == 0 else '- -'} {label}</b>"
        for index, ((color, _), label) in enumerate(zip(RUNS, labels, strict=False))
    )
    return f"<div style='padding: 0 0.8em 0.5em; font-size: 13px'>{words}</div>"

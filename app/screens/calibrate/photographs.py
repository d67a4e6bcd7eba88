"""The photographs of one camera: an error bar per view, and the chosen view as a picture."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np

from app.compute.records import Picture
from app.drawing.colors import BRAND, DELIVERED, LOSS, NEUTRAL, SOURCE, css
from app.screens.calibrate.answers import Answers
from app.screens.calibrate.area import PictureArea
from app.screens.calibrate.labels import HELD_OUT, RMS
from app.screens.calibrate.view import CameraView, Photograph
from app.web.markup import Markup
from app.window.in_address import tell_unknown
from app.window.tables import term
from app.window.ui import Ui
from pipeline.calibration.estimate import Calibration, FittedView
from pipeline.types import ByteArray, FloatArray


class Photographs:
    """Bars that can be clicked, buttons to the next view, and the picture area."""

    def __init__(
        self,
        ui: Ui,
        answers: Answers,
        on_pick: Callable[[str], None],
        on_pair: Callable[[], None],
        on_drop: Callable[[], None],
        on_all: Callable[[], None],
    ) -> None:
        """Add the parts to the current container.

        Args:
            ui: panel to add them to.
            answers: the camera's verdict, and pictures of its views.
            on_pick: called with the name of the view to show.
            on_pair: called when other pictures of it are chosen.
            on_drop: leaves the chosen view out, or uses it again.
            on_all: uses all views again.
        """
        self._ui, self._answers, self._on_pick = ui, answers, on_pick
        self._names: tuple[str, ...] = ()
        self.chosen = ""
        """Name of the view that is shown, or will be shown once it exists."""
        self._requested = ""
        self._bars = Bars(ui, on_pick)
        self._row = ui.buttons(
            "View",
            {"Back": partial(self._go, -1), "Next": partial(self._go, 1), "Drop": on_drop, "All": on_all},
            "Back, Next: previous or next view. Drop: leave this view out, or use it again. All: use all "
            "views.",
            visible=False,
        )
        self.area = PictureArea(ui, on_pair)

    def load(self, camera: CameraView | None) -> None:
        """Show the views of a camera, and the pictures of the chosen one; None shows nothing."""
        self._row.visible = camera is not None
        if camera is None:
            self.area.load({})
            self._bars.show((), "")
            return
        self._names = tuple(one.name for one in camera.photographs)
        requested, self._requested = self._requested, ""
        if self.chosen not in self._names:
            if requested and self.chosen == requested:
                self._ui.post(tell_unknown, requested, self._names)
            self.chosen = self._names[0]
        trust = self._answers.trust_in(camera)
        self._bars.show(bars_of(camera, () if trust is None else trust.outliers), self.chosen)
        photograph = picture_of(camera, self.chosen)
        pictures: dict[str, Picture] = {"photo": found_picture(photograph, camera.fitted(photograph.name))}
        if camera.calibration is not None:
            pictures["straightened"] = straightened_picture(
                pictures["photo"], camera.calibration, photograph.zoom
            )
        self.area.load(pictures | self._answers.pictures_of(camera, self.chosen))

    def place(self) -> str:
        """Return the name of the shown view for the address; empty for the first."""
        return "" if self.chosen in self._names[:1] else self.chosen

    def take(self, place: str) -> None:
        """Show the view of this name, at once or as soon as it exists."""
        self._requested = place
        self._on_pick(place or next(iter(self._names), ""))

    def _go(self, count: int) -> None:
        if self._names:
            self._on_pick(self._names[(self._names.index(self.chosen) + count) % len(self._names)])


SHIFT = 4
"""Fraction bits of drawing coordinates."""
LONGEST_PX = 22.0
"""Length at which the largest error of a view is drawn."""
FIRST = (250, 220, 0)
"""Colour of the first point, which shows the board's orientation."""


def found_picture(photograph: Photograph, fitted: FittedView | None) -> Picture:
    """Draw rings around the board's points, with lines towards their reprojections in a fitted view; or rings
    around the blobs if no board was found.
    """
    rgb = decoded(photograph)
    name = f"View {photograph.name}"
    if not photograph.found:
        _rings(rgb, photograph.blobs_px, photograph.zoom, LOSS, 6.0)
        seen = f" Red: {len(photograph.blobs_px)} blobs." if len(photograph.blobs_px) else ""
        return Picture(rgb, f"{name}, no board found. {photograph.reason.rstrip('.')}.{seen}")
    size_px = _ring_px(photograph.points_px, photograph.zoom)
    _rings(rgb, photograph.points_px, photograph.zoom, DELIVERED, size_px)
    _rings(rgb, photograph.points_px[:1], photograph.zoom, FIRST, size_px + 1.0)
    caption = f"{name}, {len(photograph.points_px)} points found (green, the first yellow)"
    if fitted is None:
        return Picture(rgb, caption)
    most_px = float(np.linalg.norm(fitted.residuals_px, axis=1).max())
    times = round_down(LONGEST_PX / max(most_px * photograph.zoom, 1e-6))
    ends_px = photograph.points_px - times * fitted.residuals_px  # towards the lens's prediction
    lines = np.stack([photograph.points_px, ends_px], axis=1) * photograph.zoom
    fixed = [np.rint(line * (1 << SHIFT)).astype(np.int32) for line in lines]
    cv2.polylines(rgb, fixed, False, SOURCE, 1, cv2.LINE_AA, shift=SHIFT)
    return Picture(rgb, f"{caption}; orange: towards their reprojection, × {times:,.0f}")


def decoded(photograph: Photograph) -> ByteArray:
    """Return the thinned photograph, (H, W, 3) RGB."""
    bgr = cv2.imdecode(np.frombuffer(photograph.jpeg, np.uint8), cv2.IMREAD_COLOR)
    assert bgr is not None
    return np.ascontiguousarray(bgr[..., ::-1])


def straightened_picture(found: Picture, camera: Calibration, zoom: float) -> Picture:
    """Return a photograph with its rings as a lens without distortion would have taken it."""
    matrix = scaled_matrix(camera.matrix, zoom)
    if camera.lens == "fisheye":
        rgb = cv2.fisheye.undistortImage(found.rgb, matrix, camera.distortion, Knew=matrix)
    else:
        rgb = cv2.undistort(found.rgb, matrix, camera.distortion)
    return Picture(rgb, "Straightened: edges that are straight in the world are straight here")


def scaled_matrix(matrix: FloatArray, zoom: float) -> FloatArray:
    """Return (3, 3) K of a scaled picture, whose pixel centres are at integers, too."""
    scale = np.array([[zoom, 0.0, 0.5 * (zoom - 1.0)], [0.0, zoom, 0.5 * (zoom - 1.0)], [0.0, 0.0, 1.0]])
    return scale @ matrix


def round_down(times: float) -> float:
    """Round down to 1, 2 or 5 times a power of ten, at least to 1."""
    power = 10.0 ** np.floor(np.log10(max(times, 1.0)))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= max(times, 1.0)))


def picture_of(camera: CameraView, name: str) -> Photograph:
    """Return the photograph of a view, or the first one."""
    return next((one for one in camera.photographs if one.name == name), camera.photographs[0])


def _rings(
    rgb: ByteArray, points_px: FloatArray, zoom: float, color: tuple[int, int, int], size_px: float
) -> None:
    for x, y in np.rint(points_px * zoom * (1 << SHIFT)).astype(int).tolist():
        cv2.circle(rgb, (x, y), round(size_px * (1 << SHIFT)), color, 1, cv2.LINE_AA, shift=SHIFT)


def _ring_px(points_px: FloatArray, zoom: float) -> float:
    """Return a radius, px of the picture, at which rings do not touch each other."""
    if len(points_px) < 2:
        return 6.0
    apart_px = np.linalg.norm(points_px[1:] - points_px[:-1], axis=1)
    return float(np.clip(0.35 * zoom * np.median(apart_px), 2.0, 8.0))


MARK = "packetmesh-views"
HEIGHT_PX, LEAST_PX = 84, 3
"""Height of the row, and least height of a bar."""


@dataclass(frozen=True, slots=True)
class Bar:
    """The bar of one view."""

    name: str
    rms_px: float | None
    """Error in the fit; None if the board was not found."""
    unseen_rms_px: float | None
    """Error by a lens that was estimated without the view."""
    dropped: bool = False
    suspect: bool = False
    """Whether dropping it is proposed."""


def bars_of(camera: CameraView, suspects: Collection[str] = ()) -> tuple[Bar, ...]:
    """Return a bar for each photograph; ``suspects`` are views that stand out."""
    bars = []
    for photograph in camera.photographs:
        name, fitted = photograph.name, camera.fitted(photograph.name)
        dropped, rms_px = name in camera.dropped, None if fitted is None else fitted.rms_px
        bars.append(Bar(name, rms_px, camera.unseen_rms_px(name), dropped, name in suspects))
    return tuple(bars)


class Bars:
    """Bars of the reprojection error, one for each view of a camera; a click on a bar chooses its view."""

    def __init__(self, ui: Ui, on_pick: Callable[[str], None]) -> None:
        """Add an empty row of bars; ``on_pick`` is called with the name of a clicked view."""
        self._on_pick = on_pick
        self._html = ui.gui.add_html(bars_html((), ""))
        self._field = ui.when_changed(ui.gui.add_text("View that was clicked", ""), self._picked)

    def show(self, bars: tuple[Bar, ...], chosen: str) -> None:
        """Show these bars; ``chosen`` is the name of the highlighted view."""
        self._html.content = bars_html(bars, chosen)

    def _picked(self) -> None:
        name = picked_name(self._field.value)
        if name:
            self._on_pick(name)


def picked_name(text: str) -> str:
    """Return the view that a page names in the hidden field; empty if the message is invalid."""
    try:
        name, _ = json.loads(text)
    except (ValueError, TypeError):
        return ""
    return name if isinstance(name, str) else ""


def bars_html(bars: tuple[Bar, ...], chosen: str) -> Markup:
    """Return HTML of the row with its axis and legend."""
    errors = [one for bar in bars for one in (bar.rms_px, bar.unseen_rms_px) if one is not None]
    most = max(errors, default=1.0)
    columns = Markup("").join(_column(bar, most, bar.name == chosen) for bar in bars)
    hide = Markup("<style>div:has(> .{}) + div {{ display: none }}</style>").format(MARK)
    if not bars:
        return Markup('<div class="{}" data-packetmesh-field>{}</div>').format(MARK, hide)
    kept = [bar.rms_px for bar in bars if bar.rms_px is not None and not bar.dropped]
    meaning = Markup(
        "Error of each of {} views, px. Bar: lens fitted to the view ({}); line: lens fitted without it "
        "({}). Click a bar."
    ).format(len(bars), term("RMS", RMS), term("held out", HELD_OUT))
    if len(kept) < len(bars):
        meaning += " ✕ no board found, pale: dropped."
    return Markup(
        '<div class="{}" data-packetmesh-field style="padding: 0 0.8em 0.5em; font-size: 12px">{}'
        '<div style="display: flex; gap: 0.4em"><div style="text-align: right; display: flex; '
        'flex-direction: column; justify-content: space-between; font-variant-numeric: tabular-nums">'
        "<span>{:.2g}</span><span>0</span></div>"
        '<div role="group" aria-label="Views" style="display: flex; flex: 1; gap: 2px; '
        "height: {}px; "
        'border-left: 1px solid #bbb; border-bottom: 1px solid #bbb">{}</div></div>'
        '<div style="margin-top: 0.3em; color: #667">{}</div></div>'
    ).format(MARK, hide, most, HEIGHT_PX, columns, meaning)


def _column(bar: Bar, most: float, chosen: bool) -> Markup:
    name = bar.name
    if bar.rms_px is None:
        label, inside = f"View {name}: no board found", Markup('<b style="color: {}">✕</b>').format(css(LOSS))
    else:
        label = f"View {name}: {bar.rms_px:.3f} px"
        if bar.unseen_rms_px is not None and not bar.dropped:
            label += f", {bar.unseen_rms_px:.3f} px held out"
        label += ", dropped" if bar.dropped else ", outlier" if bar.suspect else ""
        color = css(SOURCE) if chosen else css(LOSS) if bar.suspect else css(BRAND)
        tall = max(LEAST_PX, round(HEIGHT_PX * bar.rms_px / most))
        faint = "opacity: 0.3;" if bar.dropped else ""
        inside = Markup(
            '<i style="display: block; width: 100%; height: {}px; background: {}; {}"></i>'
        ).format(tall, color, faint)
        if bar.unseen_rms_px is not None:
            at = round(HEIGHT_PX * bar.unseen_rms_px / most)
            inside += Markup(
                '<i style="position: absolute; left: 0; right: 0; bottom: {}px; height: 2px; '
                'background: {}"></i>'
            ).format(at - 1, css(NEUTRAL))
    around = f"outline: 2px solid {css(SOURCE)};" if chosen else ""
    look = (
        "position: relative; flex: 1; min-width: 4px; height: 100%; padding: 0; border: 0; cursor: pointer; "
        f"background: transparent; display: flex; align-items: flex-end; justify-content: center; {around}"
    )
    pressed = "true" if chosen else "false"
    return Markup(
        '<button type="button" data-packetmesh-pick="{}" title="{}" aria-label="{}" aria-pressed="{}" '
        'style="{}">{}</button>'
    ).format(name, label, label, pressed, look, inside)

"""A race as a GIF for slides, made without a display."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw

from app.drawing.colors import BACKGROUND, DELIVERED, DISTANCE_STOPS, LOSS, NEUTRAL, ramp
from app.reports.captioned import EDGE_PX, INK, PAPER, SOFT, font, gif
from app.reports.projecting import camera_of, splat
from app.reports.race import RaceRun, RaceShow
from pipeline.kernels.geometry import apply
from pipeline.kernels.rays import Camera
from pipeline.types import ByteArray

WIDTH_PX, ROOM_PX, LENS_PX = 960, 300, 190
_TITLE_PX, _HEAD_PX, _FOOT_PX = 40, 92, 34
MOST_PICTURES = 40
PLAYS_S, FIRST_S, LAST_S = 8.0, 1.0, 3.0
"""Duration of the race, of its start and of its end."""
_PALETTE = ramp(np.arange(256.0), 255.0, DISTANCE_STOPS)


def race_animation(race: RaceShow) -> bytes:
    """Return a GIF, ``WIDTH_PX`` wide, that repeats without end."""
    camera = camera_of(race.view, (WIDTH_PX // len(race.runs), ROOM_PX))
    steps = np.unique(np.linspace(0, race.steps - 1, min(race.steps, MOST_PICTURES)).astype(int)).tolist()
    frames = [_frame(race, step, camera) for step in steps]
    each_s = PLAYS_S / max(len(frames), 1)
    stays_s = [FIRST_S, *[each_s] * (len(frames) - 2), LAST_S][-len(frames) :]
    return gif(frames, [round(1000 * stay_s) for stay_s in stays_s])


def _frame(race: RaceShow, step: int, camera: Camera) -> Image.Image:
    lens_px = 0 if race.lens_target is None else LENS_PX
    height = _TITLE_PX + _HEAD_PX + ROOM_PX + lens_px + _FOOT_PX
    picture = Image.new("RGB", (WIDTH_PX, height), PAPER)
    pen = ImageDraw.Draw(picture)
    pen.text((EDGE_PX, _TITLE_PX // 2), race.title, INK, font(22), anchor="lm")
    wide = WIDTH_PX // len(race.runs)
    for index, run in enumerate(race.runs):
        left, row, top = index * wide, min(step, len(run.poses) - 1), _TITLE_PX
        _head(pen, run, row, left, wide)
        top += _HEAD_PX
        picture.paste(Image.fromarray(_clouds(race, run, row, camera)), (left, top))
        if lens_px:
            picture.paste(Image.fromarray(_lens(race, run, row, (wide, lens_px))), (left, top + ROOM_PX))
            text = f"a corner magnified, {race.lens_cm:.0f} cm wide"
            pen.text((left + 8, top + ROOM_PX + 12), text, SOFT, font(13), anchor="lm")
        if index:
            pen.line((left, _TITLE_PX, left, height - _FOOT_PX), PAPER, 3)
    _scale(pen, race, height - _FOOT_PX // 2)
    return picture


def _head(pen: ImageDraw.ImageDraw, run: RaceRun, row: int, left: int, wide: int) -> None:
    """Draw name, number and status."""
    pen.rectangle((left, _TITLE_PX, left + wide, _TITLE_PX + 5), run.color)
    pen.text((left + EDGE_PX, _TITLE_PX + 18), run.name, INK, font(17), anchor="lm")
    pen.text((left + EDGE_PX, _TITLE_PX + 50), run.offs[row], INK, font(38), anchor="lm")
    ended = row == len(run.poses) - 1 and run.arrived is not None
    color = (DELIVERED if run.arrived else LOSS) if ended else SOFT
    pen.text((left + EDGE_PX, _TITLE_PX + 82), run.notes[row], color, font(15), anchor="lm")


def _clouds(race: RaceShow, run: RaceRun, row: int, camera: Camera) -> ByteArray:
    size = camera.intrinsics.height_px, camera.intrinsics.width_px, 3
    picture = np.full(size, BACKGROUND, np.uint8)
    moved_m = apply(run.poses[row], race.source_m.astype(float))
    grey = np.broadcast_to(np.array(NEUTRAL, np.uint8), race.target_m.shape)
    colors = np.vstack([grey, _PALETTE[run.shades[row]]])
    splat(picture, np.vstack([race.target_m, moved_m]), colors, camera, 2)
    return picture


def _lens(race: RaceShow, run: RaceRun, row: int, size_px: tuple[int, int]) -> ByteArray:
    """Draw the corner, cut to fill the longer side of the picture."""
    width, height = size_px
    picture = np.full((height, width, 3), PAPER, np.uint8)
    assert race.lens_target is not None
    points = run.lens[row]
    places = np.vstack([race.lens_target, points[:, :2]]).astype(float) / 255.0 - 0.5
    grey = np.broadcast_to(np.array(NEUTRAL, np.uint8), (len(race.lens_target), 3))
    colors = np.vstack([grey, _PALETTE[points[:, 2]]])
    at = np.rint(places * max(size_px) + 0.5 * np.array(size_px)).astype(int)
    for dx in range(-1, 2):
        for dy in range(-1, 2):
            column, line = (at + np.array([dx, dy])).T
            inside = (column >= 0) & (column < width) & (line >= 0) & (line < height)
            picture[line[inside], column[inside]] = colors[inside]
    return picture


def _scale(pen: ImageDraw.ImageDraw, race: RaceShow, middle: int) -> None:
    """Draw the colour scale."""
    text, low, high = race.scale
    left = EDGE_PX
    for part in (f"{text}:", low):
        pen.text((left, middle), part, INK, font(15), anchor="lm")
        left += round(pen.textlength(part, font(15))) + 8
    for at, color in enumerate(_PALETTE.tolist()):
        pen.line((left + at, middle - 6, left + at, middle + 6), tuple(color))
    left += 264
    pen.text((left, middle), high, INK, font(15), anchor="lm")
    left += round(pen.textlength(high, font(15))) + 24
    pen.rectangle((left, middle - 6, left + 12, middle + 6), NEUTRAL)
    pen.text((left + 20, middle), "the cloud that stays", INK, font(15), anchor="lm")

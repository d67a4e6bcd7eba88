"""Calibration boards to print true to scale, as PDF or SVG, or for a monitor of known pixel size, as PNG."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from xml.sax.saxutils import escape

import cv2
import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import atomic_path
from pipeline.calibration.aprilgrid import BORDERS, tag_points
from pipeline.calibration.board import MARKER_SHARE, RING, Board
from pipeline.calibration.dictionaries import dictionary
from pipeline.types import ByteArray, FloatArray

MARGIN_MM = 15.0
FOOT_MM = 16.0
"""Height below the board for the ruler and the description."""
RULER_MM, TICK_MM = 100.0, 10.0
TEXT_MM = 3.5
SUB_PIXEL = 6
"""Fractional bits of a pixel in the drawing of a PNG."""


@dataclass(frozen=True, slots=True)
class Disc:
    """A filled circle, black or white; its centre is in millimetres from the sheet's upper left."""

    x_mm: float
    y_mm: float
    radius_mm: float
    black: bool = True


@dataclass(frozen=True, slots=True)
class Box:
    """A black rectangle; x and y are those of its upper left corner."""

    x_mm: float
    y_mm: float
    width_mm: float
    height_mm: float


@dataclass(frozen=True, slots=True)
class Text:
    """A line of text; x and y are those of the left end of its baseline."""

    x_mm: float
    y_mm: float
    words: str


@dataclass(frozen=True, slots=True)
class Sheet:
    """Size and shapes of a printed sheet."""

    width_mm: float
    height_mm: float
    shapes: tuple[Disc | Box | Text, ...]


def sheet(board: Board) -> Sheet:
    """Draw the board with margins, a ruler to check the print and a line that describes it."""
    points_mm = 1000.0 * board.points_m[:, :2]
    spacing_mm, radius_mm = 1000.0 * board.spacing_m, 1000.0 * board.radius_m
    rim_mm = _around_mm(board) + MARGIN_MM
    width_mm, height_mm = np.ptp(points_mm, axis=0) + 2.0 * rim_mm
    places_mm = points_mm - points_mm[0] + place_of_first_mm(board)
    shapes: list[Disc | Box | Text]
    if board.pattern in ("chessboard", "charuco"):
        shapes = [*_squares(board, places_mm[0] - spacing_mm)]
    elif board.pattern == "aprilgrid":
        shapes = [*_tags(board, places_mm)]
    else:
        shapes = [Disc(float(x), float(y), radius_mm) for x, y in places_mm]
        if board.ambiguous:
            x, y = places_mm[0]
            shapes.append(Disc(float(x), float(y), RING[1] * radius_mm, black=False))
            shapes.append(Disc(float(x), float(y), RING[0] * radius_mm))
    width_mm = max(float(width_mm), RULER_MM + 2.0 * MARGIN_MM)
    shapes += _foot(board, float(height_mm))
    return Sheet(width_mm, float(height_mm) + FOOT_MM, tuple(shapes))


def place_of_first_mm(board: Board) -> FloatArray:
    """Return the (2,) position of the board's first point on the sheet."""
    points_mm = 1000.0 * board.points_m[:, :2]
    return points_mm[0] - points_mm.min(axis=0) + _around_mm(board) + MARGIN_MM


def _around_mm(board: Board) -> float:
    """Return the distance from the outermost points to the board's edge; around circles it is white."""
    if board.pattern == "aprilgrid":
        return 1000.0 * board.tag_spacing * board.spacing_m
    squares = board.pattern in ("chessboard", "charuco")
    return 1000.0 * (board.spacing_m if squares else 2.0 * board.radius_m)


def _squares(board: Board, corner_mm: np.ndarray) -> Iterator[Box]:
    """Yield the black squares, the first at the upper left as in OpenCV, and the markers between them."""
    side_mm = 1000.0 * board.spacing_m
    for row in range(board.rows + 1):
        for column in range(board.columns + 1):
            if (row + column) % 2 == 0:
                x_mm, y_mm = corner_mm + side_mm * np.array([column, row])
                yield Box(float(x_mm), float(y_mm), side_mm, side_mm)
    if board.pattern == "charuco":
        yield from _markers(board, corner_mm)


def _markers(board: Board, corner_mm: np.ndarray) -> Iterator[Box]:
    """Yield the black cells of every marker."""
    made, markers = board.charuco(), dictionary(board.marker_dictionary)
    cells = markers.markerSize + 2
    cell_mm = 1000.0 * MARKER_SHARE * board.spacing_m / cells
    for number, corners in zip(made.getIds().ravel().tolist(), made.getObjPoints(), strict=True):
        upper_left_mm = corner_mm + 1000.0 * np.asarray(corners)[:, :2].min(axis=0)
        yield from _cells(
            cv2.aruco.generateImageMarker(markers, number, cells, borderBits=1), upper_left_mm, cell_mm
        )


def _tags(board: Board, places_mm: FloatArray) -> Iterator[Box]:
    """Yield the black cells of every tag as Kalibr prints them, half a turn from OpenCV's orientation, and a
    black square at each of their corners.
    """
    tags = dictionary(board.marker_dictionary)
    cells = tags.markerSize + 2 * BORDERS[0]
    side_mm = 1000.0 * board.spacing_m
    gap_mm = board.tag_spacing * side_mm
    for number, points in enumerate(tag_points(board).tolist()):
        picture = cv2.aruco.generateImageMarker(tags, number, cells, borderBits=BORDERS[0])
        yield from _cells(np.rot90(picture, 2), places_mm[points[0]], side_mm / cells)
    for row in range(board.rows + 1):
        for column in range(board.columns + 1):
            x_mm, y_mm = places_mm[0] - gap_mm + (side_mm + gap_mm) * np.array([column, row])
            yield Box(float(x_mm), float(y_mm), gap_mm, gap_mm)


def _cells(picture: ByteArray, upper_left_mm: FloatArray, cell_mm: float) -> Iterator[Box]:
    """Yield the black cells of a marker, joined to as few boxes per row as possible."""
    x_mm, y_mm = upper_left_mm
    for row, line in enumerate(picture == 0):
        edges = np.flatnonzero(np.diff(np.concatenate(([0], line.astype(int), [0]))))
        for begin, end in edges.reshape(-1, 2).tolist():
            width_mm = (end - begin) * cell_mm
            yield Box(float(x_mm) + begin * cell_mm, float(y_mm) + row * cell_mm, width_mm, cell_mm)


def _foot(board: Board, top_mm: float) -> Iterator[Box | Text]:
    for tick in range(round(RULER_MM / TICK_MM) + 1):
        high_mm = 4.0 if tick % 5 == 0 else 2.5
        yield Box(MARGIN_MM + tick * TICK_MM - 0.1, top_mm - high_mm, 0.2, high_mm)
    yield Box(MARGIN_MM - 0.1, top_mm - 0.2, RULER_MM + 0.2, 0.2)
    words = f"{board.title}. The ruler is {RULER_MM:g} mm long: measure it; print at 100 %."
    yield Text(MARGIN_MM, top_mm + 5.0, words)


def write_target(board: Board, path: Path, pixel_mm: float | None = None) -> Board:
    """Write the board in the format of the suffix; returns the board with the spacings that were written.

    In a PNG the spacing, and the gap between AprilTags, are rounded to whole pixels, so that all squares, or
    tags, are equal.

    Args:
        board: the board to draw.
        path: a .pdf, .svg or .png file.
        pixel_mm: size of a pixel of the monitor that shows a PNG; other formats ignore it.

    Raises:
        InputError: the suffix is none of these, or a PNG has no pixel size from 0.01 to 5 mm.
    """
    ending = path.suffix.lower()
    if ending == ".png":
        if pixel_mm is None or not 0.01 <= pixel_mm <= 5.0:
            raise InputError(
                f"{path.name} is for a monitor: give the size of its pixels, for example --pixel-mm 0.277 "
                "(width of the screen in mm over its pixels)"
            )
        pixels = max(1, round(1000.0 * board.spacing_m / pixel_mm))
        board = replace(board, spacing_m=pixels * pixel_mm / 1000.0)
        if board.pattern == "aprilgrid":
            board = replace(board, tag_spacing=max(1, round(pixels * board.tag_spacing)) / pixels)
        content = cv2.imencode(".png", picture_of(sheet(board), pixel_mm))[1].tobytes()
    elif ending == ".svg":
        content = svg_of(sheet(board)).encode()
    elif ending == ".pdf":
        content = pdf_of(sheet(board), board.title)
    else:
        raise InputError(f"A board cannot be written as {path.name}; try .pdf, .svg or .png")
    with atomic_path(path) as sibling:
        sibling.write_bytes(content)
    return board


def svg_of(whole: Sheet) -> str:
    """Return an SVG file with millimetres as units."""
    size = f'width="{whole.width_mm:g}mm" height="{whole.height_mm:g}mm"'
    box = f'viewBox="0 0 {whole.width_mm:g} {whole.height_mm:g}"'
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} {box}>',
        '<rect width="100%" height="100%" fill="#fff"/>',
    ]
    for shape in whole.shapes:
        if isinstance(shape, Disc):
            fill = "#000" if shape.black else "#fff"
            place = f'cx="{shape.x_mm:.4f}" cy="{shape.y_mm:.4f}" r="{shape.radius_mm:.4f}"'
            lines.append(f'<circle {place} fill="{fill}"/>')
        elif isinstance(shape, Box):
            lines.append(
                f'<rect x="{shape.x_mm:.4f}" y="{shape.y_mm:.4f}" width="{shape.width_mm:.4f}" '
                f'height="{shape.height_mm:.4f}"/>'
            )
        else:
            font = f'font-family="sans-serif" font-size="{TEXT_MM}"'
            lines.append(f'<text x="{shape.x_mm:g}" y="{shape.y_mm:g}" {font}>{escape(shape.words)}</text>')
    return "\n".join([*lines, "</svg>", ""])


def pdf_of(whole: Sheet, title: str) -> bytes:
    """Return a PDF file of one page with the size of the sheet; equal boards give equal bytes."""
    import io

    from reportlab.lib.units import mm
    from reportlab.pdfgen.canvas import Canvas

    buffer = io.BytesIO()
    canvas = Canvas(buffer, pagesize=(whole.width_mm * mm, whole.height_mm * mm), invariant=True)
    canvas.setTitle(title)
    canvas.setCreator("PacketMesh")
    canvas.translate(0.0, whole.height_mm * mm)
    for shape in whole.shapes:
        if isinstance(shape, Disc):
            canvas.setFillGray(0.0 if shape.black else 1.0)
            canvas.circle(shape.x_mm * mm, -shape.y_mm * mm, shape.radius_mm * mm, stroke=0, fill=1)
        elif isinstance(shape, Box):
            canvas.setFillGray(0.0)
            low_mm = -(shape.y_mm + shape.height_mm)
            canvas.rect(
                shape.x_mm * mm, low_mm * mm, shape.width_mm * mm, shape.height_mm * mm, stroke=0, fill=1
            )
        else:
            canvas.setFillGray(0.0)
            canvas.setFont("Helvetica", TEXT_MM * mm)
            canvas.drawString(shape.x_mm * mm, -shape.y_mm * mm, shape.words)
    canvas.save()
    return buffer.getvalue()


def picture_of(whole: Sheet, pixel_mm: float) -> ByteArray:
    """Draw the sheet as an (H, W) grey image, with the edges of boxes rounded to the borders of pixels."""
    size = (round(whole.width_mm / pixel_mm), round(whole.height_mm / pixel_mm))
    picture = np.full(size[::-1], 255, np.uint8)
    scale = (1 << SUB_PIXEL) / pixel_mm

    def fixed(value_mm: float) -> int:
        return round(value_mm * scale - 0.5 * (1 << SUB_PIXEL))  # pixel centres are at integers

    def border(value_mm: float) -> int:
        """Return the nearest border of pixels; halves are rounded up, so that equal boxes stay equal."""
        return math.floor(round(value_mm / pixel_mm, 6) + 0.5)

    for shape in whole.shapes:
        if isinstance(shape, Disc):
            center, radius = (fixed(shape.x_mm), fixed(shape.y_mm)), round(shape.radius_mm * scale)
            cv2.circle(picture, center, radius, 0 if shape.black else 255, -1, cv2.LINE_AA, SUB_PIXEL)
        elif isinstance(shape, Box):
            left, top = border(shape.x_mm), border(shape.y_mm)
            right = max(left + 1, border(shape.x_mm + shape.width_mm))
            bottom = max(top + 1, border(shape.y_mm + shape.height_mm))
            picture[top:bottom, left:right] = 0
        else:
            place = (round(shape.x_mm / pixel_mm), round(shape.y_mm / pixel_mm))
            cv2.putText(
                picture,
                shape.words,
                place,
                cv2.FONT_HERSHEY_SIMPLEX,
                0.045 * TEXT_MM / pixel_mm,
                0,
                1,
                cv2.LINE_AA,
            )
    return picture

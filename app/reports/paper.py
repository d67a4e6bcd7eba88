"""A drawing on paper in millimetres, as SVG and as PDF."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import Literal
from xml.sax.saxutils import escape

import numpy as np

from app.drawing.colors import css
from pipeline.types import FloatArray

Color = tuple[int, int, int]
Anchor = Literal["start", "middle", "end"]


@dataclass(frozen=True, slots=True)
class Area:
    """A filled area; a ring inside another one is a hole in it."""

    rings_mm: tuple[FloatArray, ...]
    """(N, 2) outlines, millimetres from the sheet's upper left."""
    fill: Color
    opacity: float = 1.0
    line: Color | None = None
    """Colour of the outlines; None draws none."""
    width_mm: float = 0.2


@dataclass(frozen=True, slots=True)
class Line:
    """A line through points."""

    points_mm: FloatArray
    """(N, 2)"""
    color: Color
    width_mm: float = 0.2


@dataclass(frozen=True, slots=True)
class Words:
    """A line of text; x and y are those of its anchor on the baseline."""

    x_mm: float
    y_mm: float
    text: str
    size_mm: float = 3.0
    color: Color = (0, 0, 0)
    anchor: Anchor = "start"
    bold: bool = False


Shape = Area | Line | Words


@dataclass(frozen=True, slots=True)
class Paper:
    """Size and shapes of a sheet, drawn in their order."""

    title: str
    width_mm: float
    height_mm: float
    shapes: tuple[Shape, ...]


def disc(x_mm: float, y_mm: float, radius_mm: float) -> FloatArray:
    """Return the (32, 2) outline of a disc."""
    angles = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
    return np.array([x_mm, y_mm]) + radius_mm * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def box(left_mm: float, top_mm: float, right_mm: float, bottom_mm: float) -> FloatArray:
    """Return the (4, 2) outline of a rectangle."""
    return np.array([[left_mm, top_mm], [right_mm, top_mm], [right_mm, bottom_mm], [left_mm, bottom_mm]])


def svg_of(paper: Paper) -> str:
    """Return an SVG file with millimetres as units."""
    size = f"{paper.width_mm:g}", f"{paper.height_mm:g}"
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{size[0]}mm" height="{size[1]}mm" '
        f'viewBox="0 0 {size[0]} {size[1]}" font-family="Helvetica, Arial, sans-serif">',
        f'<title>{escape(paper.title)}</title><rect width="100%" height="100%" fill="#fff"/>',
        *map(_svg, paper.shapes),
        "</svg>",
    ]
    return "\n".join([*lines, ""])


def _svg(shape: Shape) -> str:
    if isinstance(shape, Area):
        line = "" if shape.line is None else f' stroke="{css(shape.line)}" stroke-width="{shape.width_mm:g}"'
        path = "".join(f"{_steps(ring)}Z" for ring in shape.rings_mm)
        fill = f'fill="{css(shape.fill)}" fill-rule="evenodd" fill-opacity="{shape.opacity:g}"'
        return f'<path d="{path}" {fill}{line}/>'
    if isinstance(shape, Line):
        stroke = f'stroke="{css(shape.color)}" stroke-width="{shape.width_mm:g}"'
        return f'<path d="{_steps(shape.points_mm)}" fill="none" {stroke}/>'
    place = f'x="{shape.x_mm:.2f}" y="{shape.y_mm:.2f}" text-anchor="{shape.anchor}"'
    weight = ' font-weight="bold"' if shape.bold else ""
    font = f'font-size="{shape.size_mm:g}" fill="{css(shape.color)}"{weight}'
    return f"<text {place} {font}>{escape(shape.text)}</text>"


def _steps(points_mm: FloatArray) -> str:
    """Return the path data of a line through (N, 2) points."""
    return "M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in points_mm.tolist())


def pdf_of(paper: Paper) -> bytes:
    """Return a PDF file of one page with the size of the sheet; equal sheets give equal bytes."""
    from reportlab.lib.units import mm
    from reportlab.pdfgen.canvas import Canvas

    buffer = io.BytesIO()
    canvas = Canvas(buffer, pagesize=(paper.width_mm * mm, paper.height_mm * mm), invariant=True)
    canvas.setTitle(paper.title)
    canvas.setCreator("PacketMesh")
    canvas.translate(0.0, paper.height_mm * mm)
    for shape in paper.shapes:
        if isinstance(shape, Words):
            canvas.setFillColorRGB(*_shares(shape.color))
            canvas.setFont("Helvetica-Bold" if shape.bold else "Helvetica", shape.size_mm * mm)
            draw = {
                "start": canvas.drawString,
                "middle": canvas.drawCentredString,
                "end": canvas.drawRightString,
            }
            draw[shape.anchor](shape.x_mm * mm, -shape.y_mm * mm, shape.text)
            continue
        path = canvas.beginPath()
        for points_mm in shape.rings_mm if isinstance(shape, Area) else (shape.points_mm,):
            (x, y), *others = (np.array([mm, -mm]) * points_mm).tolist()
            path.moveTo(x, y)
            for x, y in others:
                path.lineTo(x, y)
            if isinstance(shape, Area):
                path.close()
        canvas.setLineWidth(shape.width_mm * mm)
        if isinstance(shape, Line):
            canvas.setStrokeColorRGB(*_shares(shape.color))
            canvas.drawPath(path, stroke=1, fill=0)
            continue
        canvas.setFillColorRGB(*_shares(shape.fill), alpha=shape.opacity)
        if shape.line is not None:
            canvas.setStrokeColorRGB(*_shares(shape.line))
        canvas.drawPath(path, stroke=shape.line is not None, fill=1, fillMode=0)  # even-odd
        canvas.setFillAlpha(1.0)
    canvas.save()
    return buffer.getvalue()


def _shares(color: Color) -> tuple[float, ...]:
    return tuple(channel / 255.0 for channel in color)

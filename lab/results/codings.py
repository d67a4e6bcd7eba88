"""The tables of docs/results.md about codings of images."""

from __future__ import annotations

from itertools import groupby

from lab.results.markdown import Cell, Row, percent, table

DEPTH_COLUMNS = ("depth coder", "pieces", "kB an image", "of RVL", "encoding, ms", "decoding, ms")
COLOR_COLUMNS = (
    "colour coder",
    "pieces",
    "kB an image",
    "of JPEG",
    "quality",
    "error of vertices",
    "encoding, ms",
)


def codings(numbers: Row) -> str:
    """Return the tables of the record, group after group."""
    runs = numbers["codings"]["runs"]
    parts = [
        "Depth: all coders are lossless; *pieces*: what one lost byte destroys. The tables of our coders "
        "come from training rooms. Colour: of each coder the lowest quality at which an image is as like its "
        "original as JPEG's of quality 90 (SSIM); the error is the root mean square over pixels with depth, "
        "of 255. Pieces are without headers. The program sends AVIF of quality 82, the lowest at which each "
        "image of the validation rooms is as like its original. Times are medians of one core."
    ]
    for (kind, group), rows in groupby(runs, key=lambda run: (run["kind"], run["group"])):
        found = list(rows)
        title = f"{'Depth' if kind == 'depth' else 'Colour'}, {found[0]['images']} images of {group}:"
        columns, line = (DEPTH_COLUMNS, _depth) if kind == "depth" else (COLOR_COLUMNS, _color)
        parts += [title, table(columns, [line(row) for row in found])]
    return "\n\n".join(parts)


def _depth(row: Row) -> tuple[Cell, ...]:
    return (row["coder"], row["pieces"], f"{row['kb']:.1f}", percent(row["of_base"]), *_times(row))


def _color(row: Row) -> tuple[Cell, ...]:
    size = (row["coder"], row["pieces"], f"{row['kb']:.1f}", percent(row["of_base"]))
    return (*size, f"{row['quality']:.0f}", f"{row['rmse']:.2f}", _times(row)[0])


def _times(row: Row) -> tuple[str, str]:
    return f"{1000.0 * row['encode_s']:.0f}", f"{1000.0 * row['decode_s']:.0f}"

"""Parts of all written reports, each of which is one self-contained HTML file."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Literal

import cv2

from app.reports.document import document
from app.web.markup import Markup
from packetmesh.files import atomic_path
from pipeline.types import ByteArray

STYLE = Markup("""
:root { color-scheme: light dark; --line: #8884; --soft: #8881; --good: #1a7f4b; --bad: #b3261e; }
body { font: 15px/1.55 system-ui, sans-serif; max-width: 1180px; margin: 2rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.7rem; margin: 0 0 .3rem; } h2 { font-size: 1.2rem; margin: 2.2rem 0 .6rem; }
p.lead { font-size: 1.05rem; } .note { opacity: .75; font-size: .92em; }
table { border-collapse: collapse; width: 100%; } th { font-weight: 600; }
th:not(:first-child) { text-align: right; }
th, td { text-align: left; padding: .35rem .7rem .35rem 0; border-bottom: 1px solid var(--line);
  vertical-align: top; }
td:not(:first-child) { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.pictures { display: grid; gap: .9rem; margin-bottom: 1.1rem; }
figure { margin: 0; } figure img { width: 100%; border-radius: 6px; display: block; background: var(--soft); }
figcaption { font-size: .88em; opacity: .8; margin-top: .3rem; }
code { background: var(--soft); padding: .1em .35em; border-radius: 4px; }
h3 { font-size: 1rem; margin: 1.6rem 0 .4rem; } .wide { overflow-x: auto; }
.picture { display: inline-block; vertical-align: top; max-width: 560px; margin-right: 1.5rem; }
svg.chart { max-width: 100%; height: auto; }
.reproduced { color: var(--good); font-weight: 600; } .not-reproduced { color: var(--bad); font-weight: 600; }
""")


def page(title: str, body: Markup, scripts: Sequence[Markup] = ()) -> Markup:
    """Return a whole HTML document."""
    return document(title, body, STYLE, scripts)


def write_page(path: Path, title: str, body: Markup, scripts: Sequence[Markup] = ()) -> None:
    """Write a document to ``path``, whole or not at all."""
    with atomic_path(path) as temporary:
        Path(temporary).write_text(page(title, body, scripts), encoding="utf-8")


def picture(rgb: ByteArray, caption: str, kind: Literal["jpeg", "png"] = "jpeg") -> Markup:
    """Return an (H, W, 3) RGB image with its caption, as an HTML figure that contains the image."""
    options = [cv2.IMWRITE_JPEG_QUALITY, 88] if kind == "jpeg" else []
    _, encoded = cv2.imencode(f".{kind}", rgb[..., ::-1], options)
    data = base64.b64encode(encoded.tobytes()).decode()
    return Markup(
        '<figure><img alt="{caption}" src="data:image/{kind};base64,{data}">'
        "<figcaption>{caption}</figcaption></figure>"
    ).format(caption=caption, kind=kind, data=data)


def pictures(figures: Iterable[Markup], columns: int) -> Markup:
    """Return figures side by side, ``columns`` to a row."""
    return Markup('<div class="pictures" style="grid-template-columns: repeat({}, 1fr)">{}</div>').format(
        columns, Markup("").join(figures)
    )


def table(header: Sequence[str], rows: Iterable[Sequence[str | float | int | None]]) -> Markup:
    """Return a table with a name first in each row; other cells are aligned right, a dash for None."""
    head = Markup("").join(map(Markup("<th>{}</th>").format, header))
    body = Markup("").join(map(_row, rows))
    return Markup("<table><thead><tr>{}</tr></thead><tbody>{}</tbody></table>").format(head, body)


def text(value: str | float | int | None) -> str:
    """Return a value as text: four significant digits, no power of ten for large ones; a dash for None."""
    if value is None:
        return "–"
    if isinstance(value, str):
        return value
    if isinstance(value, int) or abs(value) >= 9999.5:
        return f"{value:,.0f}"
    return f"{value:.4g}"


def _row(values: Sequence[str | float | int | None]) -> Markup:
    cells = Markup("").join(map(Markup("<td>{}</td>").format, map(text, values)))
    return Markup("<tr>{}</tr>").format(cells)

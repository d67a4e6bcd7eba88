"""Pages of one file that a browser shows without a network: a body, styles, scripts and what they read."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from string import Template
from typing import Any

from app.drawing.colors import DELIVERED, INFERRED, LOSS, SOURCE, TARGET, css

_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
"""The page may load nothing from anywhere."""
_COLORS = {"delivered": DELIVERED, "lost": LOSS, "source": SOURCE, "target": TARGET, "inferred": INFERRED}
_STYLE = "offline_page.css"


def offline_page(
    title: str,
    body: str,
    words: Mapping[str, str],
    parts: Sequence[str],
    record: Mapping[str, Any],
    blocks: Mapping[str, bytes],
) -> str:
    """A self-contained HTML document.

    Args:
        title: of the window.
        body: name of the file beside this one with the page's body, a template.
        words: what stands for its names, as plain text.
        parts: names of the files beside this one with its styles and scripts, in their order.
        record: what the scripts read as JSON, in the element ``record``.
        blocks: what they read as bytes, each in an element of that name.
    """
    texts = {part: _text(part) for part in (_STYLE, *parts)}
    styles = "\n".join(text for part, text in texts.items() if part.endswith(".css"))
    scripts = "\n".join(text for part, text in texts.items() if part.endswith(".js"))
    colors = "".join(f"--{name}: {css(color)};" for name, color in _COLORS.items())
    data = "".join(
        f'<script type="text/plain" id="{name}">{base64.b64encode(block).decode()}</script>\n'
        for name, block in blocks.items()
    )
    content = Template(_text(body)).substitute({name: escape(word) for name, word in words.items()})
    text = json.dumps(record, allow_nan=False).replace("<", "\\u003c")
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>:root {{{colors}}}\n{styles}</style></head>"
        f'<body>{content}\n<script type="application/json" id="record">{text}</script>\n{data}'
        f'<script>"use strict";\n{scripts}</script></body></html>\n'
    )


def _text(name: str) -> str:
    return (Path(__file__).parent / name).read_text(encoding="utf-8")

"""Pages of one file that need no network: body, styles, scripts and their data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from app.drawing.colors import DELIVERED, INFERRED, LOSS, SOURCE, TARGET, css
from app.reports.document import bytes_block, document, json_block, shipped
from app.web.markup import Markup

_COLORS = {"delivered": DELIVERED, "lost": LOSS, "source": SOURCE, "target": TARGET, "inferred": INFERRED}
_STYLE = "offline_page.css"


def offline_page(
    title: str,
    body: str,
    words: Mapping[str, str],
    parts: Sequence[str],
    record: Mapping[str, Any],
    blocks: Mapping[str, bytes],
) -> Markup:
    """Return a self-contained HTML document.

    Args:
        title: title of the window.
        body: file name of the page's body, a template in this folder.
        words: plain texts that replace the template's names.
        parts: file names of the styles and scripts in this folder, in their order.
        record: data that the scripts read as JSON, in the element ``record``.
        blocks: bytes that they read, each in an element of that name.
    """
    texts = {part: _shipped(part) for part in (_STYLE, *parts)}
    colors = Markup("").join(Markup("--{}: {};").format(name, css(color)) for name, color in _COLORS.items())
    styles = [Markup(":root {{{}}}").format(colors)]
    styles += [text for part, text in texts.items() if part.endswith(".css")]
    scripts = [Markup('"use strict";')]
    scripts += [text for part, text in texts.items() if part.endswith(".js")]
    content = [_shipped(body).format(**words), json_block("record", record)]
    content += [bytes_block(name, block) for name, block in blocks.items()]
    lines = Markup("\n")
    return document(title, lines.join(content), lines.join(styles), [lines.join(scripts)])


def _shipped(name: str) -> Markup:
    return shipped(Path(__file__).parent / name)

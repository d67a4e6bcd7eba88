"""Pages of one file that a browser shows without a network: a body, styles, scripts and what they read."""

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
    """A self-contained HTML document.

    Args:
        title: of the window.
        body: name of the file beside this one with the page's body, a template.
        words: what stands for its names, as plain text.
        parts: names of the files beside this one with its styles and scripts, in their order.
        record: what the scripts read as JSON, in the element ``record``.
        blocks: what they read as bytes, each in an element of that name.
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

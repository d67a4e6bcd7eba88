"""A whole HTML document in one file. Its policy has a browser run no script but the document's own, and load
nothing from anywhere.

What stands in scripts and styles is no text that could be escaped; it comes from files of the program, or it
is JSON or base64.
"""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

from app.web.markup import Markup

_POLICY = Markup(
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
)
"""Styles may stand in the page: pictures of plotly and grids have some of their own."""
_DOCUMENT = Markup(
    '<!doctype html><html lang="en"><head>'
    '<meta http-equiv="Content-Security-Policy" content="{policy}"><meta charset="utf-8">'
    '<meta name="viewport" content="width=device-width, initial-scale=1">'
    "<title>{title}</title><style>{style}</style></head><body>{body}{scripts}</body></html>\n"
)


def document(title: str, body: Markup, style: Markup, scripts: Sequence[Markup] = ()) -> Markup:
    """Return a self-contained document.

    Args:
        title: of the window, as text.
        body: what it shows.
        style: its style sheet.
        scripts: what runs below the body, in this order; no other script does.
    """
    policy = _POLICY
    if scripts:
        hashes = Markup(" ").join(map(_hash, scripts))
        policy += Markup("; script-src {}").format(hashes)
    elements = Markup("").join(map(Markup("<script>{}</script>").format, scripts))
    return _DOCUMENT.format(policy=policy, title=title, style=style, body=body, scripts=elements)


def shipped(path: Path) -> Markup:
    """Return what a file of the program or of plotly holds, to stand in a page as it is."""
    return Markup(path.read_text(encoding="utf-8"))  # noqa: S704


def json_block(name: str, value: Any) -> Markup:
    """Return an element of that name with a value that scripts read as JSON."""
    text = json.dumps(value, allow_nan=False).replace("<", "\\u003c")  # so nothing in it ends the element
    return Markup('<script type="application/json" id="{}">{}</script>').format(name, Markup(text))  # noqa: S704


def bytes_block(name: str, data: bytes) -> Markup:
    """Return an element of that name with bytes that scripts read as base64."""
    return Markup('<script type="text/plain" id="{}">{}</script>').format(name, b64encode(data).decode())


def _hash(script: Markup) -> Markup:
    """By which the policy knows a script."""
    return Markup("'sha256-{}'").format(b64encode(sha256(script.encode()).digest()).decode())

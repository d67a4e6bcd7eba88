"""A whole HTML document in one file. Its content policy lets the browser run only the document's own scripts
and load nothing.

Scripts, styles and data are not escaped: they come from files of the program, or are JSON or base64.
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
"""Content policy; styles are allowed in the page because plotly's pictures and grids set some."""
_DOCUMENT = Markup(
    '<!doctype html><html lang="en"><head>'
    '<meta http-equiv="Content-Security-Policy" content="{policy}"><meta charset="utf-8">'
    '<meta name="viewport" content="width=device-width, initial-scale=1">'
    "<title>{title}</title><style>{style}</style></head><body>{body}{scripts}</body></html>\n"
)


def document(title: str, body: Markup, style: Markup, scripts: Sequence[Markup] = ()) -> Markup:
    """Return a self-contained document.

    Args:
        title: title of the window, as text.
        body: content of the page.
        style: its style sheet.
        scripts: scripts below the body, in their order; no other script can run.
    """
    policy = _POLICY
    if scripts:
        hashes = Markup(" ").join(map(_hash, scripts))
        policy += Markup("; script-src {}").format(hashes)
    elements = Markup("").join(map(Markup("<script>{}</script>").format, scripts))
    return _DOCUMENT.format(policy=policy, title=title, style=style, body=body, scripts=elements)


def shipped(path: Path) -> Markup:
    """Return the content of a file of the program or of plotly, to be inserted unchanged."""
    return Markup(path.read_text(encoding="utf-8"))  # noqa: S704


def json_block(name: str, value: Any) -> Markup:
    """Return an element with this id and a value, without NaN or infinity, that scripts read as JSON."""
    text = json.dumps(value, allow_nan=False).replace("<", "\\u003c")  # nothing in it closes the element
    return Markup('<script type="application/json" id="{}">{}</script>').format(name, Markup(text))  # noqa: S704


def bytes_block(name: str, data: bytes) -> Markup:
    """Return an element with this id and bytes that scripts read as base64."""
    return Markup('<script type="text/plain" id="{}">{}</script>').format(name, b64encode(data).decode())


def _hash(script: Markup) -> Markup:
    """Return the hash by which the policy identifies a script."""
    return Markup("'sha256-{}'").format(b64encode(sha256(script.encode()).digest()).decode())

"""Text that becomes HTML or markdown; inserted values are escaped, so that text from a file stays text.

``Markup("<b>{}</b>").format(name)`` escapes the name, and so do joining and adding. A plain ``str`` is never
markup: it is escaped as a whole where it is shown (``app.window.gui``). Only literals are made into markup;
the linter (S704) reports anything else.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from markupsafe import Markup, escape

__all__ = ["Markdown", "Markup", "escape", "plain_text", "shipped_markdown"]

_ACTIVE = re.compile(
    r"(<[^>]*>|&#?\w+;)"  # tags and character references stay
    r"|([\\`*\[\]~|]|(?<![^\W_])_|_(?![^\W_]))"
)
"""Characters that markdown takes for emphasis, code, links, tables and escapes."""
_LEADING = re.compile(r"^(\s*\d*)([#+\-=.)])(?=[\s#+\-=]|$)")
"""Characters that make a heading, a rule or a list at the beginning of a line, also behind spaces."""
_NOTHING = re.compile(r"(?!)")


class Markdown(Markup):
    """Markdown in which inserted values are plain text on one line: no tag, link or emphasis."""

    __slots__ = ()

    @classmethod
    def escape(cls, s: Any, /) -> Markdown:
        """Return a value as markdown that shows its plain text; markup stays markup.

        Args:
            s: any value; ``Markup`` keeps its tags, ``Markdown`` is returned unchanged.
        """
        if isinstance(s, Markdown):
            return s
        line = re.sub(r"\s+", " ", escape(s))
        line = _ACTIVE.sub(lambda found: found[1] or f"&#{ord(found[2])};", line)
        return cls(_LEADING.sub(lambda found: f"{found[1]}&#{ord(found[2])};", line))


def shipped_markdown(
    text: str, field: re.Pattern[str] = _NOTHING, value: Callable[[re.Match[str]], object] = str
) -> Markdown:
    """Return the markdown of a text file, such as a lesson; its HTML tags are shown as text.

    Args:
        text: text of the file.
        field: pattern of the fields that are replaced.
        value: gives the plain text that replaces a field.
    """
    plain = text.replace("&", "&amp;").replace("<", "&lt;")
    return Markdown(field.sub(lambda found: plain_text(Markdown.escape(value(found))), plain))  # noqa: S704


def plain_text(markup: str) -> str:
    """Return the markup as a plain ``str``, the type that viser can send."""
    return "".join(markup)

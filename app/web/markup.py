"""Text that becomes HTML or markdown: whatever is inserted is escaped, so that a file's text stays text.

``Markup("<b>{}</b>").format(name)`` escapes the name; joining and adding do, too. A plain ``str`` is never
markup: where it is shown it is escaped as a whole (``app.window.gui``). Only literals are made into markup;
the linter (S704) reports anything else.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from markupsafe import Markup, escape

__all__ = ["Markdown", "Markup", "escape", "plain_text", "shipped_markdown"]

_ACTIVE = re.compile(
    r"(<[^>]*>|&#?\w+;)"  # tags and what is escaped already stay
    r"|([\\`*\[\]~|]|(?<![^\W_])_|_(?![^\W_]))"
)
"""What markdown would take for emphasis, code, links, tables and escapes."""
_LEADING = re.compile(r"^(\d*)([#+\-=.)])(?=[\s#+\-=]|$)")
"""What makes a heading, a rule or a list at the beginning of a line."""
_NOTHING = re.compile(r"(?!)")


class Markdown(Markup):
    """Markdown in which everything inserted is text: no tag, no link, no emphasis, on one line."""

    __slots__ = ()

    @classmethod
    def escape(cls, s: Any, /) -> Markdown:
        """Return a value as markdown that shows just its text; markup stays markup.

        Args:
            s: any value; ``Markup`` keeps its tags, ``Markdown`` is returned as it is.
        """
        if isinstance(s, Markdown):
            return s
        line = re.sub(r"\s+", " ", escape(s))
        line = _ACTIVE.sub(lambda found: found[1] or f"&#{ord(found[2])};", line)
        return cls(_LEADING.sub(lambda found: f"{found[1]}&#{ord(found[2])};", line))


def shipped_markdown(
    text: str, field: re.Pattern[str] = _NOTHING, value: Callable[[re.Match[str]], object] = str
) -> Markdown:
    """Return the markdown of a file that is part of the program; tags in it become text all the same.

    Args:
        text: of the file.
        field: what in it is replaced.
        value: what stands there instead, as text.
    """
    plain = text.replace("&", "&amp;").replace("<", "&lt;")
    return Markdown(field.sub(lambda found: plain_text(Markdown.escape(value(found))), plain))  # noqa: S704


def plain_text(markup: str) -> str:
    """Return the same letters as a ``str`` of its own, which is what viser can send."""
    return "".join(markup)

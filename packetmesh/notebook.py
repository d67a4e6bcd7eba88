"""The base of all results that a notebook shows as a table."""

from __future__ import annotations

from importlib import import_module


class ShownInNotebooks:
    """A result whose table a notebook shows; ``pipeline.notebook`` makes it, and is imported only then."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        """Return the result's table, with its picture, as HTML for Jupyter and marimo."""
        html: str = import_module("pipeline.notebook").html_of(self)
        return html

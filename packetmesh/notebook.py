"""Base class of the results that a notebook shows as a table."""

from __future__ import annotations

from importlib import import_module


class ShownInNotebooks:
    """A result that a notebook shows as a table; ``pipeline.notebook`` is imported when the table is made."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        """Return the result's table, with its picture, as HTML for Jupyter and marimo."""
        html: str = import_module("pipeline.notebook").html_of(self)
        return html

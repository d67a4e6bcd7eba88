"""HTML of results for notebooks: a table with units, and a picture."""

from pipeline.notebook.tables import html_of

__all__ = ["html_of"]

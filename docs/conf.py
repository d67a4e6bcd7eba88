"""Settings of the documentation site, which ``make docs`` builds with Sphinx."""

import json
import re
from pathlib import Path

from sphinx.errors import ExtensionError

project = "PacketMesh"
copyright = "The PacketMesh authors"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
source_suffix = {".md": "markdown", ".ipynb": "markdown"}
exclude_patterns = ["examples/*.py", "results/*"]
html_theme = "furo"
html_title = "PacketMesh"
myst_heading_anchors = 4
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_type_aliases = {
    name: name for name in ("FloatArray", "IntArray", "BoolArray", "ByteArray", "AnyPath")
}
python_use_unqualified_type_names = True

DOCS = Path(__file__).parent
LINK = re.compile(r"\[([^\]]*)\]\(((?:\.\./|results(?=[/)])|examples(?=[/)]))[^)#\s]*)(#[^)\s]*)?\)")
"""Links to files of the repository that are no pages of the site."""


def setup(app):
    """Have notebooks read as pages, and links that leave the site written as plain text."""
    app.connect("source-read", with_notebooks_as_pages)
    app.connect("source-read", without_links_out)
    app.connect("include-read", seen_from_docs)


def with_notebooks_as_pages(app, page, source):
    """Replace a notebook by its text and code."""
    if Path(app.env.doc2path(page)).suffix != ".ipynb":
        return
    cells = json.loads(source[0])["cells"]
    texts = ["".join(cell["source"]) for cell in cells]
    parts = [
        text if cell["cell_type"] == "markdown" else f"```python\n{text}\n```"
        for cell, text in zip(cells, texts, strict=True)
    ]
    source[0] = "\n\n".join(parts)


def seen_from_docs(app, path, page, content):
    """Have an included file of the repository's root link as a page in docs does."""
    text = re.sub(r"\]\((?!https?:|#)", "](../", content[0]).replace("](../docs/", "](")
    content[0] = text.replace("](../CHANGELOG.md", "](changelog.md")
    without_links_out(app, page, content)


def without_links_out(app, page, source):
    """Replace each link to a file that is no page by its text.

    Raises:
        ExtensionError: the file is not there.
    """

    def text_of(link):
        if not (DOCS / link[2]).exists():
            raise ExtensionError(f"docs/{page}.md links to {link[2]}, which is not there")
        return link[1]

    source[0] = LINK.sub(text_of, source[0])

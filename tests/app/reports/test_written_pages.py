"""Written pages show the texts that they are given as text, and forbid everything that they do not need."""

from __future__ import annotations

import hashlib
import re
from base64 import b64encode
from html.parser import HTMLParser

import pytest

from tests.app.written_pages import EVIL, PAGES

VOID = {"meta", "img", "input", "rect", "line", "polygon", "polyline", "br"}
DATA = {"application/json", "text/plain"}


class Read(HTMLParser):
    """The elements of a page, the text that one reads in it, and its scripts that run."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.text, self.scripts, self.within = "", [], ""
        self.feed(page)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))
        self.within = "" if tag in VOID else tag
        if tag == "script" and dict(attributes).get("type") not in DATA:
            self.within = "running"
            self.scripts.append("")

    def handle_endtag(self, tag):
        self.within = ""

    def handle_data(self, data):
        if self.within == "running":
            self.scripts[-1] += data
        elif self.within not in ("script", "style"):
            self.text += data

    def of(self, *tags):
        return [attributes for tag, attributes in self.elements if tag in tags]


@pytest.fixture(scope="module", params=PAGES)
def page(request, tmp_path_factory):
    return PAGES[request.param](tmp_path_factory.mktemp("page"))


def test_text_from_outside_is_there_to_read_and_nothing_else(page):
    read = Read(page)
    assert EVIL in read.text
    assert "&lt;h2&gt;" not in page  # our own markup is no text
    assert read.of("iframe", "object", "embed", "base", "link", "form", "frame", "template") == []
    assert all(one["src"].startswith("data:image/") for one in read.of("img"))
    assert all(one.keys() <= {"type", "id"} for one in read.of("script"))
    assert [name for _, attributes in read.elements for name in attributes if name.startswith("on")] == []
    assert not any("pwned" in script for script in read.scripts)


def test_the_policy_lets_the_pages_own_scripts_run_and_no_others(page):
    read = Read(page)
    tags = [tag for tag, _ in read.elements]
    first = read.elements[tags.index("head") + 1]
    assert first[0] == "meta"
    assert first[1]["http-equiv"] == "Content-Security-Policy"
    policy = dict(part.split(" ", 1) for part in first[1]["content"].split("; "))
    hashes = [b64encode(hashlib.sha256(one.encode()).digest()).decode() for one in read.scripts]
    assert policy.get("script-src", "").split() == [f"'sha256-{one}'" for one in hashes]
    assert policy["default-src"] == policy["base-uri"] == policy["form-action"] == "'none'"
    assert policy["img-src"] == "data:"
    assert policy.keys() <= {"default-src", "script-src", "img-src", "style-src", "base-uri", "form-action"}


def test_nothing_is_asked_of_another_place(page):
    plain = page
    for script in Read(page).scripts:
        plain = plain.replace(script, "")  # plotly's holds addresses that it does not ask
    for word in ("@import", "url(", "fetch(", "import(", "srcset"):
        assert word not in plain
    assert not re.search(r"""(src|href)=["']?(https?:)?//""", plain)

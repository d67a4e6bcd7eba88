"""What is put into HTML or markdown as text is read as that text, and is nothing else."""

import re
from html.parser import HTMLParser

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from markdown_it import MarkdownIt

from app.web.markup import Markdown, Markup, plain_text, shipped_markdown
from app.window.gui import Gui
from tests.app.fakes import Gui as FakeGui

RENDER = MarkdownIt("commonmark", {"html": True}).enable(["table", "strikethrough"]).render
TEXTS = st.text(
    st.one_of(st.sampled_from("<>&\"'`*_~[]()#+-=.!|\\\\:/0123456789 \n\tab"), st.characters(codec="utf-8")),
    max_size=40,
)


class Read(HTMLParser):
    """The elements and the text of some HTML."""

    def __init__(self, html):
        super().__init__()
        self.tags, self.text = [], ""
        self.feed(html)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)

    def handle_data(self, data):
        self.text += data


def squeezed(text):
    return " ".join(text.replace("\0", "\ufffd").split())


@given(TEXTS)
@example("**bold** _x_ node_00 a_b_c")
@example("[x](javascript:y) ![i](z) `code` ~~s~~")
@example("1. one")
@example("- two\n\n# three\n> four")
@example("a | b\n- | -\n1 | 2")
@example(" #")
@example("  12. a")
@example("&lt;b&gt; &#42; \\* <b onclick=x>")
def test_text_in_markdown_is_a_paragraph_of_that_text(text):
    read = Read(RENDER(plain_text(Markdown("{}").format(text))))
    assert set(read.tags) <= {"p"}
    assert squeezed(read.text) == squeezed(text)


@given(TEXTS, TEXTS)
def test_text_in_html_is_that_text_also_in_an_attribute(text, other):
    html = Markup('<b title="{}">{}</b>').format(text, other)
    read = Read(html)
    assert read.tags == ["b"]
    assert read.text == other


def test_markup_stays_markup_and_markdown_keeps_its_own_marks():
    inner = Markup("<b>{}</b>").format("*x*<i>")
    assert Markup("<p>{}</p>").format(inner) == "<p><b>*x*&lt;i&gt;</b></p>"
    assert Markdown("a {}").format(inner) == "a <b>&#42;x&#42;&lt;i&gt;</b>"
    assert Markdown("a {}").format(Markdown("**{}**").format("*")) == "a **&#42;**"
    assert Markdown("{:.1f} and {:,}").format(-2.55, 1234) == "-2.5 and 1,234"
    assert Markdown(", ").join(["*", Markdown("*b*")]) == "&#42;, *b*"
    assert Markdown("one.") + " Two" == "one. Two"


def test_a_shipped_file_has_no_tags_and_its_fields_are_text():
    text = shipped_markdown("*a* <b>&amp; {x}", re.compile(r"\{(x)\}"), lambda found: f"<{found[1]}>*")
    assert text == "*a* &lt;b>&amp;amp; &lt;x&gt;&#42;"
    assert isinstance(text, Markdown)


@pytest.mark.parametrize(("add", "kind"), [("add_html", Markup), ("add_markdown", Markdown)])
def test_a_panel_shows_a_string_as_text_and_sends_viser_plain_strings(add, kind):
    fake = FakeGui()
    gui = Gui(fake)
    piece = getattr(gui, add)("<b>*x*</b>")
    (sent,) = fake.handles
    assert "<" not in sent.content
    for content in (kind("<b>{}</b>").format("<"), "<i>"):
        piece.content = content
        assert type(sent.content) is str
    assert sent.content == "&lt;i&gt;"
    assert isinstance(piece.content, kind)
    piece.visible = False
    assert not sent.visible
    assert not piece.visible

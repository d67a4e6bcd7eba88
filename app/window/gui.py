"""The control panel as screens use it: viser's, with HTML and markdown escaped unless they are markup."""

from __future__ import annotations

from typing import Any, Generic, TypeVar

from app.web.markup import Markdown, Markup, plain_text

Kind = TypeVar("Kind", bound=Markup)


class Piece(Generic[Kind]):
    """A piece of HTML or markdown in the panel. Everything but its content is passed to viser's handle."""

    _handle: Any
    _kind: type[Kind]
    _content: Kind

    def __init__(self, handle: Any, kind: type[Kind], content: Kind) -> None:
        vars(self).update(_handle=handle, _kind=kind, _content=content)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._handle, name)

    def __setattr__(self, name: str, value: Any) -> None:
        if name == "content":
            object.__setattr__(self, name, value)
        else:
            setattr(self._handle, name, value)

    @property
    def content(self) -> Kind:
        """The content that is shown. A ``str`` that is not markup is shown as plain text."""
        return self._content

    @content.setter
    def content(self, content: Kind) -> None:
        vars(self)["_content"] = self._kind.escape(content)
        self._handle.content = plain_text(self._content)


class Gui:
    """viser's ``GuiApi``, with HTML and markdown methods that escape text that is not markup."""

    def __init__(self, gui: Any) -> None:
        """Wrap the panel of a browser, or of all browsers."""
        self._gui = gui
        gui._setup_plotly_js = True  # the page has plotly (app.web.page); viser would run it with eval

    def __getattr__(self, name: str) -> Any:
        return getattr(self._gui, name)

    def add_html(self, content: Markup, **options: Any) -> Piece[Markup]:
        """Add HTML to the current container; ``options`` are viser's."""
        content = Markup.escape(content)
        return Piece(self._gui.add_html(plain_text(content), **options), Markup, content)

    def add_markdown(self, content: Markdown, **options: Any) -> Piece[Markdown]:
        """Add markdown to the current container; ``options`` are viser's."""
        content = Markdown.escape(content)
        return Piece(self._gui.add_markdown(plain_text(content), **options), Markdown, content)

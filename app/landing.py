"""What a new browser sees first: the lessons and the scenes, each with a picture, over the scene that loads.

It is a part of the page itself, so that it is there before viser is. An address with anything behind a ``?``
goes past it.
"""

from __future__ import annotations

import base64
import contextlib
import functools
from collections.abc import Callable, Iterator
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import Any

from websockets.asyncio import server as websockets_server
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from app.dock_row import add_hidden
from app.lesson import LESSONS
from app.session import Session
from pipeline.io.demos import DEMO_SCENES
from pipeline.sources import Demo

PICTURES = Path(__file__).resolve().parents[1] / "assets" / "landing"
"""``NAME.jpg`` of every lesson and scene."""
STEP_OF_LESSON = {
    "can-a-picture-measure": "Depth",
    "icp-against-ceicp": "Fuse",
    "which-ball-radius": "Surface",
    "how-images-cross-a-network": "Network",
    "what-one-lost-packet-costs": "Network",
    "how-good-is-my-calibration": "Calibrate",
}
"""The screen of each lesson, in the order in which they are offered."""
OPEN = "Open scene "
"""Begins the name of the unseen button for each scene."""
_SCRIPT, _STYLE = (Path(__file__).with_suffix(kind).read_text(encoding="utf-8") for kind in (".js", ".css"))
_END = b"</body>"


def landing_html() -> str:
    """The screen: what stands over viser's page, with its style and script."""
    lessons = "".join(
        _card(name, _title(name), f'data-step="{step}"') for name, step in STEP_OF_LESSON.items()
    )
    scenes = "".join(_card(name, scene.title, f'data-scene="{name}"') for name, scene in DEMO_SCENES.items())
    return (
        f'<style>{_STYLE}</style><main id="packetmesh-landing" role="dialog" aria-label="Welcome">'
        "<header><div><h1>PacketMesh</h1><p>From a camera network's packets to a surface mesh.</p></div>"
        '<button type="button" data-explore>Explore <kbd>Esc</kbd></button></header>'
        f"<h2>Six lessons, each of one question</h2><section>{lessons}</section>"
        f"<h2>Or a scene to explore</h2><section>{scenes}</section></main><script>{_SCRIPT}</script>"
    )


def _title(lesson: str) -> str:
    """The title that the lesson's file begins with."""
    text = (LESSONS / f"{lesson}.md").read_text(encoding="utf-8")
    return text.partition("\n")[0].removeprefix("# ").strip()


def _card(name: str, title: str, data: str) -> str:
    picture = base64.b64encode((PICTURES / f"{name}.jpg").read_bytes()).decode()
    image = f'<img alt="" src="data:image/jpeg;base64,{picture}">'
    label = escape(title)
    return f'<button type="button" {data} data-title="{label}">{image}<span>{label}</span></button>'


def add_scene_buttons(session: Session) -> None:
    """What the landing presses to open a scene, unseen; to be called on the session's thread."""
    with add_hidden(session.ui, "landing", ""):
        for name in DEMO_SCENES:
            button = session.gui.add_button(f"{OPEN}{name}")
            button.on_click(functools.partial(_post, session, name))


def _post(session: Session, name: str, _: Any) -> None:
    session.post(lambda: session.want(replace(session.spec, source=Demo(name))))


@contextlib.contextmanager
def landing_first() -> Iterator[None]:
    """Servers that start meanwhile send the landing with their page; viser has no option for it."""
    serve = websockets_server.serve

    @functools.wraps(serve)
    def landed(*arguments: Any, process_request: Callable[[Any, Any], Any], **options: Any) -> Any:
        return serve(*arguments, process_request=_with_landing(process_request), **options)

    setattr(websockets_server, "serve", landed)  # noqa: B010
    try:
        yield
    finally:
        setattr(websockets_server, "serve", serve)  # noqa: B010


def _with_landing(answer: Callable[[Any, Request], Response | None]) -> Callable[[Any, Request], Any]:
    """The server's own answer, with the landing in the page that a browser opens."""
    landing = landing_html().encode()

    def landed(connection: Any, request: Request) -> Response | None:
        is_page = request.path == "/" and request.headers.get("Upgrade") != "websocket"
        if not is_page:
            return answer(connection, request)
        plain = Headers(
            (name, value) for name, value in request.headers.raw_items() if name != "Accept-Encoding"
        )
        response = answer(connection, replace(request, headers=plain))
        if response is None or response.status_code != 200:
            return response
        before, end, after = bytes(response.body).rpartition(_END)
        body = before + landing + end + after
        del response.headers["Content-Length"]
        response.headers["Content-Length"] = str(len(body))
        return replace(response, body=body)

    return landed

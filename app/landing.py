"""What a new browser sees first: the lessons and the scenes, each with a picture, over the scene that loads.

It is a part of the page itself, so that it is there before viser is. An address with anything behind a ``?``
goes past it; in a lecture only the one to which the teacher's link leads shows it, without the scenes.
"""

from __future__ import annotations

import base64
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import partial
from html import escape
from pathlib import Path
from typing import Any

from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from app.lesson_file import LESSONS
from app.origin import answering
from pipeline.io.demos import DEMO_SCENES

PICTURES = Path(__file__).resolve().parents[1] / "assets" / "landing"
"""``NAME.jpg`` of every lesson and scene."""
LESSON_PLACES = {
    "can-a-picture-measure": ("living-room", "depth"),
    "icp-against-ceicp": ("living-room", "fuse"),
    "which-ball-radius": ("living-room", "surface"),
    "how-images-cross-a-network": ("living-room", "network"),
    "what-one-lost-packet-costs": ("living-room", "network"),
    "how-good-is-my-calibration": ("uncalibrated", "calibrate"),
}
"""The scene that each lesson speaks of and its screen, in the order in which they are offered."""
_SCRIPT, _STYLE = (Path(__file__).with_suffix(kind).read_text(encoding="utf-8") for kind in (".js", ".css"))
_END = b"</body>"
WELCOME = "/?welcome"
"""Where the teacher's link leads."""


def landing_html(lecture: bool = False) -> str:
    """The screen: what stands over viser's page, with its style and script."""
    lessons = "".join(
        _card(name, _title(name), f"scene={scene}&screen={screen}", lesson=True)
        for name, (scene, screen) in LESSON_PLACES.items()
    )
    scenes = "".join(_card(name, scene.title, f"scene={name}") for name, scene in DEMO_SCENES.items())
    shared = " data-lecture" if lecture else ""
    others = "" if lecture else f"<div><h2>Or a scene to explore</h2><section>{scenes}</section></div>"
    return (
        f'<style>{_STYLE}</style><main id="packetmesh-landing"{shared} role="dialog" aria-label="Welcome">'
        "<header><div><h1>PacketMesh</h1><p>From a camera network's packets to a surface mesh.</p></div>"
        '<button type="button" data-explore>Explore <kbd>Esc</kbd></button></header>'
        f"<article><div><h2>Six lessons, each of one question</h2><section>{lessons}</section></div>{others}"
        f"</article></main><script>{_SCRIPT}</script>"
    )


def _title(lesson: str) -> str:
    """The title that the lesson's file begins with."""
    text = (LESSONS / f"{lesson}.md").read_text(encoding="utf-8")
    return text.partition("\n")[0].removeprefix("# ").strip()


def _card(name: str, title: str, place: str, lesson: bool = False) -> str:
    """A button that leads to a place, by its address; and there to the lesson of that title."""
    picture = base64.b64encode((PICTURES / f"{name}.jpg").read_bytes()).decode()
    image = f'<img alt="" src="data:image/jpeg;base64,{picture}">'
    label = escape(title)
    data = f'data-place="{escape(place)}"' + (f' data-lesson="{label}"' if lesson else "")
    return f'<button type="button" {data}>{image}<span>{label}</span></button>'


def landing_first(lecture: bool = False) -> AbstractContextManager[None]:
    """Servers that start meanwhile send the landing with their page; in a lecture only to the teacher."""
    return answering(partial(_with_landing, WELCOME if lecture else "/", landing_html(lecture).encode()))


def _with_landing(
    path: str, landing: bytes, answer: Callable[[Any, Request], Response | None]
) -> Callable[[Any, Request], Any]:
    """The server's own answer, with the landing in the page that a browser opens by this path."""

    def landed(connection: Any, request: Request) -> Response | None:
        is_page = request.path == path and request.headers.get("Upgrade") != "websocket"
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

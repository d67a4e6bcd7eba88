"""The page that a browser gets: viser's, with the app's scripts and styles, and the landing over it, which
offers the lessons and the scenes, each with a picture, while the first scene loads.

The landing is a part of the page itself, so that it is there before viser is. An address with anything behind
a question mark goes past it; in a lecture only the teacher's link shows it, without the scenes.
"""

from __future__ import annotations

import base64
from pathlib import Path

from app.lesson.files import LESSONS
from app.web.entrance import WELCOME
from app.web.markup import Markup
from app.web.page import Page
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

_HERE = Path(__file__).parent
SCRIPTS = tuple(
    _HERE / f"{name}.js"
    for name in (
        *("window/page", "window/hint", "window/dock_row", "dock/dock_view", "dock/dock", "dock/dock_plots"),
        *("session/address", "lesson/lesson", "session/lecture", "screens/fuse/board", "landing"),
    )
)
"""In the order in which they run."""
STYLES = tuple(
    _HERE / f"{name}.css"
    for name in (
        *("window/page", "window/hint", "lesson/lesson", "dock/dock", "session/lecture"),
        *("screens/fuse/board", "landing"),
    )
)


def app_page(lecture: bool) -> Page:
    """Return the page of the app; in a lecture only the teacher is greeted.

    Raises:
        InputError: the installed viser has another page than those that are known.
    """
    return Page(SCRIPTS, STYLES, {WELCOME if lecture else "/": landing_html(lecture)})


def landing_html(lecture: bool = False) -> Markup:
    """The screen: what stands over viser's page; its style and script are among the page's (``page.py``)."""
    lessons = Markup("").join(
        _card(name, _title(name), f"scene={scene}&screen={screen}", lesson=True)
        for name, (scene, screen) in LESSON_PLACES.items()
    )
    scenes = Markup("").join(_card(name, scene.title, f"scene={name}") for name, scene in DEMO_SCENES.items())
    shared = Markup(" data-lecture") if lecture else ""
    others = Markup("<div><h2>Or a scene to explore</h2><section>{}</section></div>").format(scenes)
    return Markup(
        '<main id="packetmesh-landing"{} inert role="dialog" aria-label="Welcome">'
        "<header><div><h1>PacketMesh</h1><p>From a camera network's packets to a surface mesh.</p></div>"
        '<button type="button" data-explore>Explore <kbd>Esc</kbd></button></header>'
        "<article><div><h2>Six lessons, each of one question</h2><section>{}</section></div>{}"
        "</article></main>"
    ).format(shared, lessons, "" if lecture else others)


def _title(lesson: str) -> str:
    """The title that the lesson's file begins with."""
    text = (LESSONS / f"{lesson}.md").read_text(encoding="utf-8")
    return text.partition("\n")[0].removeprefix("# ").strip()


def _card(name: str, title: str, place: str, lesson: bool = False) -> Markup:
    """A button that leads to a place, by its address; and there to the lesson of that title."""
    picture = base64.b64encode((PICTURES / f"{name}.jpg").read_bytes()).decode()
    image = Markup('<img alt="" src="data:image/jpeg;base64,{}">').format(picture)
    data = Markup('data-place="{}"').format(place)
    if lesson:
        data += Markup(' data-lesson="{}"').format(title)
    return Markup('<button type="button" {}>{}<span>{}</span></button>').format(data, image, title)

"""The page that a browser gets: viser's, with the app's scripts and styles, and over it the landing, which
offers lessons, scenes and the folder for one's own images while the first scene loads.

The landing is part of the page itself, so it is shown before viser starts. An address with a query skips it;
in a lecture only the teacher's link shows it, without the scenes.
"""

from __future__ import annotations

import base64
from pathlib import Path

from app.lesson.files import LESSONS
from app.web.entrance import WELCOME
from app.web.markup import Markup
from app.web.page import Page
from pipeline.io.demos import DEMOS

PICTURES = Path(__file__).resolve().parents[1] / "assets" / "landing"
"""Folder of ``NAME.jpg`` of every lesson and scene."""
LESSON_PLACES = {
    "can-a-picture-measure": ("living-room", "depth"),
    "icp-against-ceicp": ("living-room", "fuse"),
    "which-ball-radius": ("living-room", "surface"),
    "how-images-cross-a-network": ("living-room", "network"),
    "what-one-lost-packet-costs": ("living-room", "network"),
    "how-good-is-my-calibration": ("uncalibrated", "calibrate"),
    "how-a-walk-becomes-a-room": ("living-room-walk", "fuse"),
}
"""Scene and screen of each lesson, in the order in which the lessons are offered."""
OWN_FOLDER = "Use your own images"
"""Title of the Scene screen's folder for uploads."""

_HERE = Path(__file__).parent
SCRIPTS = tuple(
    _HERE / f"{name}.js"
    for name in (
        *("window/page", "window/plotly", "window/hint", "window/notice", "window/dock_row"),
        *("dock/dock_view", "dock/dock", "dock/dock_plots"),
        *("session/address", "window/actions", "lesson/lesson", "session/lecture"),
        *("screens/fuse/lanes", "screens/fuse/board"),
        *("landing", "web/refused"),
    )
)
"""Scripts in the order in which they run."""
STYLES = tuple(
    _HERE / f"{name}.css"
    for name in (
        *("window/page", "window/hint", "window/notice", "lesson/lesson", "dock/dock", "session/lecture"),
        *("screens/fuse/board", "landing", "web/refused"),
    )
)


def app_page(lecture: bool) -> Page:
    """Return the app's page; in a lecture only the teacher sees the landing.

    Raises:
        InputError: the installed viser has an unknown page.
    """
    return Page(SCRIPTS, STYLES, {WELCOME if lecture else "/": landing_html(lecture)})


def landing_html(lecture: bool = False) -> Markup:
    """Return the landing's HTML; its style and script are among the page's files."""
    lessons = Markup("").join(
        _card(name, _title(name), f"scene={scene}&screen={screen}", lesson=True)
        for name, (scene, screen) in LESSON_PLACES.items()
    )
    scenes = Markup("").join(_card(name, scene.title, f"scene={name}") for name, scene in DEMOS.items())
    shared = Markup(" data-lecture") if lecture else ""
    own = Markup('<button type="button" data-place="screen=scene" data-folder="{}">Open your own …</button>')
    others = Markup("<div><h2>Or a scene to explore</h2><section>{}</section>{}</div>").format(
        scenes, own.format(OWN_FOLDER)
    )
    return Markup(
        '<main id="packetmesh-landing"{} inert role="dialog" aria-label="Welcome">'
        "<header><div><h1>PacketMesh</h1><p>From a camera network's packets to a surface mesh.</p></div>"
        '<button type="button" data-explore>Explore <kbd>Esc</kbd></button></header>'
        "<article><div><h2>Seven lessons, each about one question</h2><section>{}</section></div>{}"
        "</article></main>"
    ).format(shared, lessons, "" if lecture else others)


def _title(lesson: str) -> str:
    """Return the title in the first line of a lesson's file."""
    text = (LESSONS / f"{lesson}.md").read_text(encoding="utf-8")
    return text.partition("\n")[0].removeprefix("# ").strip()


def _card(name: str, title: str, place: str, lesson: bool = False) -> Markup:
    """Return a button that opens a place by its address and, for a lesson, the lesson of that title."""
    picture = base64.b64encode((PICTURES / f"{name}.jpg").read_bytes()).decode()
    image = Markup('<img alt="" src="data:image/jpeg;base64,{}">').format(picture)
    data = Markup('data-place="{}"').format(place)
    if lesson:
        data += Markup(' data-lesson="{}"').format(title)
    return Markup('<button type="button" {}>{}<span>{}</span></button>').format(data, image, title)

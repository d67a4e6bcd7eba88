"""The page that a browser gets: viser's page with the app's scripts and styles. The landing covers it and
offers lessons, scenes and the upload of own images while the first scene loads.

The landing is part of the page itself, so it is shown before viser starts. An address with a query skips it;
in a lecture only the teacher's link shows it, without the scenes.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from app.lesson.files import LESSONS, Lesson, screen_of
from app.lesson.reading import head_of, languages, titles_of
from app.web.entrance import WELCOME
from app.web.markup import Markup
from app.web.page import Page
from app.window.in_address import STOP
from app.window.teaching import ENGLISH
from pipeline.io.demos import DEMOS

PICTURES = Path(__file__).resolve().parents[1] / "assets" / "landing"
"""Folder with the picture ``NAME.jpg`` of each shipped lesson and each demo scene."""
SHIPPED = {
    "can-a-picture-measure": STOP,
    "icp-against-ceicp": STOP,
    "which-ball-radius": STOP,
    "how-images-cross-a-network": STOP,
    "what-one-lost-packet-costs": f"{STOP}-lost",
    "how-good-is-my-calibration": STOP,
    "how-a-walk-becomes-a-room": f"{STOP}-walk",
    "where-should-the-camera-stand": f"{STOP}-camera",
}
"""Lessons that ship, in the order in which they are offered, each with the key of its stop in the address."""
OwnCards = Sequence[tuple[Lesson[Any], str]]
"""A teacher's own lessons, each with the query of its first stop."""
OWN_FOLDER = "Use your own images"
"""Title of the Scene screen's folder for uploads."""

_HERE = Path(__file__).parent
SCRIPTS = tuple(
    _HERE / f"{name}.js"
    for name in (
        *("window/page", "window/names", "window/plotly", "window/hint", "window/notice", "window/dock_row"),
        *("dock/dock_view", "dock/dock", "dock/dock_plots"),
        *("session/address", "window/actions", "window/palette", "lesson/lesson", "session/lecture"),
        *("window/frames", "screens/fuse/lanes", "screens/fuse/board", "looking/look", "looking/scale"),
        *("landing", "web/refused", "drawing/packing", "web/contents"),
    )
)
"""Scripts in the order in which they run."""
STYLES = tuple(
    _HERE / f"{name}.css"
    for name in (
        *("window/page", "window/hint", "window/notice", "window/palette", "lesson/lesson", "dock/dock"),
        *("session/lecture", "screens/fuse/board", "looking/scale", "landing", "web/refused"),
    )
)


def app_page(lecture: bool, own: OwnCards = ()) -> Page:
    """Return the app's page; in a lecture only the teacher sees the landing.

    Raises:
        InputError: the installed viser has an unknown page.
    """
    return Page(SCRIPTS, STYLES, {WELCOME if lecture else "/": landing_html(lecture, own)})


def landing_html(lecture: bool = False, own: OwnCards = ()) -> Markup:
    """Return the landing's HTML; its style and script are among the page's files."""
    lessons = Markup("").join(
        _card(name, titles[ENGLISH], _place(name), titles)
        for name, titles in ((name, titles_of(LESSONS / f"{name}.md")) for name in SHIPPED)
    )
    teachers = Markup("").join(_own_card(lesson, place) for lesson, place in own)
    if teachers:
        teachers = Markup("<h2>Your own lessons</h2><section data-own>{}</section>").format(teachers)
    scenes = Markup("").join(_card(name, scene.title, f"scene={name}") for name, scene in DEMOS.items())
    shared = Markup(" data-lecture") if lecture else ""
    upload = Markup(
        '<button type="button" data-place="screen=scene" data-folder="{}">Open your own …</button>'
    )
    others = Markup("<div><h2>Or a scene to explore</h2><section>{}</section>{}</div>").format(
        scenes, upload.format(OWN_FOLDER)
    )
    return Markup(
        '<main id="packetmesh-landing"{} inert role="dialog" aria-label="Welcome">'
        "<header><div><h1>PacketMesh</h1><p>From a camera network's packets to a surface mesh.</p></div>"
        "<label data-languages>Lessons in <select>{}</select></label>"
        '<button type="button" data-explore>Explore <kbd>Esc</kbd></button></header>'
        "<article><div>{}<h2>Eight lessons, each about one question</h2><section>{}</section></div>{}"
        "</article></main>"
    ).format(shared, _languages(own), teachers, lessons, "" if lecture else others)


def _place(lesson: str) -> str:
    """Return the query of an address that opens a lesson that ships at its first stop."""
    head, _ = head_of((LESSONS / f"{lesson}.md").read_text(encoding="utf-8"))
    return f"scene={head['scene'][1]}&{SHIPPED[lesson]}=1&screen={screen_of(head['screen'][1])}"


def _languages(own: OwnCards) -> Markup:
    """Return the HTML options of the drop-down for the lessons' language."""
    options = ((code, code, name) for code, name in languages(lesson for lesson, _ in own).items())
    return Markup("").join(Markup('<option value="{}" lang="{}">{}</option>').format(*one) for one in options)


def _own_card(lesson: Lesson[Any], place: str) -> Markup:
    """Return a button that opens one of the teacher's own lessons."""
    titles = {lesson.language: lesson.title}
    titles |= {code: other.title for code, other in lesson.translations.items()}
    data = Markup('data-place="{}" data-titles="{}"').format(place, json.dumps(titles))
    return Markup('<button type="button" {}><span lang="{}">{}</span></button>').format(
        data, lesson.language, lesson.title
    )


def _card(name: str, title: str, place: str, titles: Mapping[str, str] | None = None) -> Markup:
    """Return a button with the picture ``name`` that opens a place.

    Args:
        name: name of the lesson or scene.
        title: text on the button.
        place: query of the address to open.
        titles: titles of the lesson by language; None for a scene.
    """
    picture = base64.b64encode((PICTURES / f"{name}.jpg").read_bytes()).decode()
    image = Markup('<img alt="" src="data:image/jpeg;base64,{}">').format(picture)
    data = Markup('data-place="{}"').format(place)
    if titles is not None:
        data += Markup(' data-titles="{}"').format(json.dumps(titles))
    return Markup('<button type="button" {}>{}<span>{}</span></button>').format(data, image, title)

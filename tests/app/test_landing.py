"""The landing screen in the page that a browser opens, and what it offers."""

from __future__ import annotations

import gzip
import hashlib
import html
import http.client
import re
from pathlib import Path

import pytest
import viser

import app.landing
from app.compute.state import Spec
from app.landing import OWN_FOLDER, PICTURES, SCRIPTS, SHIPPED, STYLES, app_page, landing_html
from app.lesson.files import LESSONS, screen_of
from app.lesson.reading import head_of
from app.screens.scene.panel import ScenePanel
from app.server import PANELS
from app.session.address import Place, place_of
from packetmesh.errors import InputError
from pipeline.io.demos import DEMOS
from pipeline.sources import Demo, demo_of
from tests.app.fakes import Bench, ui_of


@pytest.fixture(scope="module")
def port():
    with app_page(lecture=False).served():
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server.get_port()
    server.stop()


def fetch(port, path, encoding="gzip", **headers):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.request("GET", path, headers={"Accept-Encoding": encoding, **headers})
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer, gzip.decompress(body) if answer.getheader("Content-Encoding") == "gzip" else body


def get(port, path):
    answer, body = fetch(port, path)
    return answer.status, body.decode()


def test_it_is_in_the_page_of_the_bare_address_only(port):
    status, page = get(port, "/")
    assert status == 200
    assert page.count('id="packetmesh-landing"') == 1
    assert page.rstrip().endswith("</html>")
    assert "packetmesh-landing" not in get(port, "/?scene")[1]
    assert get(port, "/nothing")[0] == 404


def test_the_page_has_its_title_and_the_apps_own_files_from_the_first_byte(port):
    page = get(port, "/?scene")[1]
    assert page.count("<title>PacketMesh</title>") == page.count("<title>") == 1
    (script,) = re.findall('<script defer src="([^"]+)">', page)
    (plotly,) = re.findall('<meta name="packetmesh-plotly" content="([^"]+)">', page)
    (style,) = re.findall('<link rel="stylesheet" href="([^"]+)">', page)
    assert not any(
        one.startswith("/") for one in (script, plotly, style)
    )  # a proxy may have a path of its own
    assert "Plotly" in get(port, f"/{plotly}")[1]
    assert all(one.read_text("utf-8") in get(port, f"/{script}")[1] for one in SCRIPTS)
    assert all(one.read_text("utf-8") in get(port, f"/{style}")[1] for one in STYLES)
    here = Path(app.landing.__file__).parent
    parts = {*here.rglob("*.js"), *here.rglob("*.css")} - {*(here / "reports").iterdir()}
    assert parts == {*SCRIPTS, *STYLES}


def test_a_browser_that_has_the_page_gets_it_once(port):
    first, page = fetch(port, "/?scene")
    assert first.getheader("Set-Cookie").startswith("packetmesh_page=")
    again, nothing = fetch(port, "/?scene", **{"If-None-Match": first.getheader("ETag")})
    assert (again.status, nothing) == (304, b"")
    assert again.getheader("ETag") == first.getheader("ETag")
    assert "Set-Cookie" in again.headers
    other, same = fetch(port, "/?scene", **{"If-None-Match": fetch(port, "/")[0].getheader("ETag")})
    assert (other.status, same) == (200, page)


def test_browsers_keep_the_files_by_their_content_and_ask_for_the_page_again(port):
    page = get(port, "/")[1]
    files = re.findall('(?:src|href|content)="((?:packetmesh|plotly)-[^"]+)"', page)
    assert len(files) == 3
    for path in (f"/{name}" for name in files):
        packed, content = fetch(port, path)
        assert packed.getheader("Content-Encoding") == "gzip"
        assert "immutable" in packed.getheader("Cache-Control")
        assert hashlib.sha256(content).hexdigest()[:12] in path
        kind = "text/css" if path.endswith(".css") else "text/javascript"
        assert packed.getheader("Content-Type") == f"{kind}; charset=utf-8"
        plain, same = fetch(port, path, "identity")
        assert (plain.getheader("Content-Encoding"), same) == ("identity", content)
    assert fetch(port, "/")[0].getheader("Cache-Control") == "private, no-cache"


@pytest.mark.parametrize(
    ("known", "other"),
    [
        ("data-p=", "data-q="),
        ('data-p="', 'data-p="~~~~~'),
        ('data-p="', 'data-p="\u00e9'),
        ("<title>Viser</title>", "<title>Other</title>"),
        ("</head>", "<script>1</script></head>"),
        ('if(document.readyState==="loading")', "if(true)"),
    ],
)
def test_another_page_of_viser_is_no_page_of_the_app(monkeypatch, tmp_path, known, other):
    page = (Path(viser.__file__).parent / "client" / "build" / "index.html").read_text("utf-8")
    path = tmp_path / "client" / "build" / "index.html"
    path.parent.mkdir(parents=True)
    path.write_text(page.replace(known, other, 1), "utf-8")
    monkeypatch.setattr(viser, "__file__", str(tmp_path / "__init__.py"))
    with pytest.raises(InputError, match=re.escape(f"viser {viser.__version__} is not known")):
        app_page(lecture=False)


def test_it_offers_every_lesson_and_every_scene_with_a_small_picture():
    assert set(SHIPPED) == {path.stem for path in LESSONS.glob("*.md") if "." not in path.stem}
    names = {*SHIPPED, *DEMOS}
    assert {path.stem for path in PICTURES.iterdir()} == names
    assert all(path.stat().st_size <= 40_000 for path in PICTURES.iterdir())
    page = landing_html()
    assert page.count("data:image/jpeg") == len(names)
    assert all(f">{scene.title}</span>" in page for scene in DEMOS.values())
    for name in SHIPPED:
        title = (LESSONS / f"{name}.md").read_text().splitlines()[0].removeprefix("# ")
        assert f">{title}</span>" in page


def test_every_card_leads_to_a_place_that_an_address_can_name():
    start = Place(Spec(Demo("office")), "Scene")
    sources = {name: demo_of(name) for name in DEMOS}
    titles = tuple(panel.title for panel in PANELS)
    places = [html.unescape(place) for place in re.findall('data-place="([^"]+)"', landing_html())]
    keys = [*dict.fromkeys(SHIPPED.values())]
    found, wrong = zip(*(place_of(place, start, titles, sources, keys) for place in places), strict=True)
    assert not any(wrong)
    stops = [((key, "1"),) for key in SHIPPED.values()] + [()] * (len(DEMOS) + 1)
    assert [place.added for place in found] == stops
    heads = [head_of((LESSONS / f"{name}.md").read_text())[0] for name in SHIPPED]
    wanted = [(head["scene"][1], screen_of(head["screen"][1])) for head in heads]
    wanted += [(name, "scene") for name in DEMOS]
    wanted += [("office", "scene")]  # the folder for uploads, in the scene that is open
    assert [(place.spec.source.title, place.screen.lower()) for place in found] == wanted


def test_the_button_for_own_images_names_the_folder_of_the_scene_screen(store, tmp_path):
    assert f'data-folder="{OWN_FOLDER}"' in landing_html()
    assert "data-folder" not in landing_html(lecture=True)
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        bench = Bench(ScenePanel, ui_of(server.scene), store, tmp_path, steps=("scene",))
        assert "A recording" in bench.gui.text(OWN_FOLDER)
    finally:
        server.stop()

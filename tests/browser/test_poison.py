"""Text out of strangers' files is there to read in the page, and never runs."""

from __future__ import annotations

import io
import json
import zipfile
from urllib.parse import quote

import onnx
import pytest
from onnx import TensorProto, helper

from tests.bad_input.samples import MM, RGB, bag, opencv
from tests.browser.hands import PATIENCE_MS, STEPS, afresh, go, unfold
from tests.browser.test_policy import WATCH

MARKUP = (
    '<iframe srcdoc="<script>parent.pwned=1</script>"></iframe>',
    "<img src=x onerror=parent.pwned=1>",
    "<script>parent.pwned=1</script>",
    "<svg onload=parent.pwned=1>",
    "[click](javascript:parent.pwned=1) ![x](x) **bold** `code`",
    "{parent.pwned=1} ${parent.pwned=1} {{parent.pwned=1}}",
    "&lt;img src=x onerror=parent.pwned=1&gt; &#60;script&#62;",
    "'\"--></style></script><img src=x onerror=parent.pwned=1>",
)
"""What an attacker would have a file say."""
NAME = "x<img src=q onerror=parent.pwned=1>"
"""What may stand in the name of a file or a folder."""
K = {"width": 32, "height": 24, "fx": 28, "fy": 28, "cx": 15, "cy": 11}


@pytest.fixture(scope="module")
def watched(browser, app):
    """A tab that notes what is forbidden, from before any script runs."""
    context = browser.new_context(viewport={"width": 900, "height": 700})
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.add_init_script(WATCH)
    page.errors = []
    page.on("pageerror", lambda error: page.errors.append(str(error)))
    page.home = app.url
    page.goto(f"{app.url}/?screen=scene")
    page.get_by_text("Each camera node delivers").wait_for()
    yield page
    context.close()


@pytest.fixture
def page(watched):
    """The same with a session of its own. Nothing that it notes is forgotten between tests."""
    afresh(watched)
    return watched


def unharmed(page):
    """Nothing ran, nothing was tried, and nothing of what is shown is of the attacker's making."""
    page.wait_for_timeout(500)
    assert page.evaluate("window.pwned") is None
    assert page.evaluate("window.forbidden") == []
    assert not page.locator("iframe, object, embed, [onerror], [onload], a[href^='javascript']").count()
    assert not page.locator("img[src='x'], img[src='q']").count()


def zipped(files):
    """A ZIP of these files, by their names."""
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return made.getvalue()


def node(name="node_00", **camera):
    """The files of one camera of a rig."""
    return {
        f"rig/{name}/color.png": opencv(RGB, ".png"),
        f"rig/{name}/depth.png": opencv(MM, ".png"),
        f"rig/{name}/intrinsics.json": json.dumps(K | camera).encode(),
    }


def upload(page, label, name, content):
    """Choose a file behind an upload button that can be seen."""
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name=label).locator("visible=true").first.click()
    chooser.value.set_files([{"name": name, "mimeType": "application/octet-stream", "buffer": content}])


def says(page, text):
    """The text, as it is written, stands somewhere in the page."""
    page.wait_for_function("text => document.body.innerText.replace(/\\s+/g, ' ').includes(text)", arg=text)


@pytest.mark.parametrize("text", MARKUP)
def test_what_a_camera_file_says_of_its_lens(page, text):
    unfold(page, "Use your own images")
    lens = {"distortion_model": text, "D": [0.0] * 4, "K": [28, 0, 15, 0, 28, 11, 0, 0, 1]}
    upload(page, "Recording", "rig.zip", zipped(node(**lens)))
    says(page, " ".join(text.split())[:40])
    unharmed(page)


@pytest.mark.parametrize("kind", ["ros1", "mcap"])
def test_topics_and_the_lens_of_a_bag(page, kind):
    poisoned = bag(kind).replace(b"/cam0", b"/<u>a").replace(b"plumb_bob", b"<b>x</b>9")
    unfold(page, "Use your own images")
    upload(page, "Recording", f"a.{'bag' if kind == 'ros1' else kind}", poisoned)
    says(page, "/<u>a/color/camera_info has the lens <b>x</b>9")
    unharmed(page)


def test_names_of_a_rig_its_cameras_and_its_folder(page):
    unfold(page, "Use your own images")
    files = node(f"node_00{NAME}") | node(f"node_01{NAME}")
    upload(page, "Recording", f"{NAME}.zip", zipped(files))
    says(page, f"node_00{NAME}")
    page.get_by_text("Up to date").wait_for(timeout=120_000)
    for screen in STEPS[1:]:
        go(page, screen)
        page.wait_for_timeout(1500)
        unharmed(page)
    assert "onerror" not in page.url.replace(quote(NAME), "")


def test_a_file_that_is_no_photograph(page):
    go(page, "Calibrate")
    unfold(page, "Use your own photographs")
    upload(page, "Photograph or ZIP", f"{NAME}.txt", b"x")
    says(page, f"{NAME}.txt")
    unharmed(page)


def test_photographs_and_what_a_zip_says_of_its_board(page):
    go(page, "Calibrate")
    unfold(page, "Use your own photographs")
    board = json.dumps({"pattern": MARKUP[0], "columns": 4, "rows": 4, "spacing_mm": 30}).encode()
    upload(
        page,
        "Photograph or ZIP",
        "board.zip",
        zipped({f"{NAME}.png": opencv(RGB, ".png"), "board.json": board}),
    )
    page.wait_for_timeout(1500)
    unharmed(page)


def test_a_network_with_poisoned_names_and_metadata(page):
    go(page, "Depth")
    unfold(page, "Neural network")
    value = helper.make_tensor_value_info(MARKUP[1], TensorProto.FLOAT, [1, 3, 8, 8])
    out = helper.make_tensor_value_info(MARKUP[2], TensorProto.FLOAT, [1, 3, 8, 8])
    graph = helper.make_graph([helper.make_node("Neg", [MARKUP[1]], [MARKUP[2]])], MARKUP[0], [value], [out])
    model = helper.make_model(graph, producer_name=MARKUP[0], doc_string=MARKUP[3])
    entry = model.metadata_props.add()
    entry.key, entry.value = MARKUP[1], MARKUP[2]
    upload(page, "Add an ONNX file", f"{NAME}.onnx", model.SerializeToString())
    says(page, "x<img src=q")
    unharmed(page)
    upload(
        page, "Add an ONNX file", f"{NAME}2.onnx", onnx.ModelProto(doc_string=MARKUP[0]).SerializeToString()
    )
    page.wait_for_timeout(1500)
    unharmed(page)


KEYS = ("scene", "preset", "screen", "set", "stop", "cam")


@pytest.mark.parametrize("key", KEYS)
def test_an_address(page, key):
    afresh(page, f"{key}={quote(MARKUP[1])}")
    page.get_by_text("Each camera node delivers").wait_for()
    page.wait_for_timeout(1000)
    unharmed(page)


def test_a_page_that_loads_with_all_of_these(page):
    page.goto(f"{page.home}/?{'&'.join(f'{key}={quote(MARKUP[1])}' for key in KEYS)}")
    page.get_by_text("Each camera node delivers").wait_for()
    page.wait_for_timeout(1000)
    unharmed(page)


def test_what_a_person_writes(page):
    go(page, "Network")
    page.get_by_text("Advanced", exact=True).locator("visible=true").last.click()
    label = page.locator("label", has_text="Setting key=value").first
    label.locator("xpath=ancestor::*[.//input][1]//input").first.fill("<svg/onload=parent.pwned=1>")
    page.get_by_role("button", name="Use these settings").click()
    says(page, "<svg/onload")
    unharmed(page)


def test_even_past_the_escaping_nothing_runs(page, app):
    """The policy alone holds: HTML put straight into viser's panel, as no part of the app does."""
    (session,) = [one for one in app.sessions.values() if not one._closed][-1:]
    viser_gui = session.target.gui
    for text in (*MARKUP, "<a id=bait href='javascript:parent.pwned=1'>bait</a>"):
        viser_gui.add_html(text)
        viser_gui.add_markdown(text)
    page.get_by_text("bait").first.wait_for()
    page.wait_for_timeout(1000)
    assert page.evaluate("window.pwned") is None
    assert sum("script-src" in one for one in page.evaluate("window.forbidden")) >= 4
    page.evaluate("document.querySelectorAll('#bait').forEach(one => one.click())")
    page.wait_for_timeout(1000)
    assert page.evaluate("window.pwned") is None

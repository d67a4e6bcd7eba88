"""Nothing passes the gate that a hand could not have done, on any control of any screen."""

import contextlib
import logging
import struct
import sys
import time
from pathlib import Path

import pytest
import viser
from viser import _messages as messages

sys.path.insert(0, str(Path(__file__).parent))
from attacker import connected, wrong_for

import app.web.gate as gates
from app.load.connection import Connection, wait_for
from app.server import build_server
from app.web import viser_private as private
from app.web.gate import FLOOD, MOST_FORGED, PNG, VALUES, Gate

pytestmark = pytest.mark.xdist_group("attack")  # one worker starts the server once
PROPERTIES = (
    {"update_cb": []},
    {"removed": True},
    {"sync_cb": None},
    {"visible": False},
    {"disabled": True},
    {"options": ["x"]},
    {"props": {}},
    {"uuid": "x"},
    {"is_button": True},
    {"__class__": 1},
    {"value": None, "removed": True},
    {},
)


@pytest.fixture(scope="module")
def running():
    """The app, and the gate that it has made."""
    made = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("app.server.Gate", lambda server: made.append(Gate(server)) or made[0])
        app = build_server("box-on-table", port=0)
    (app.viser_server.gate,) = made
    yield app
    app.stop()


@pytest.fixture
def patient(monkeypatch):
    """A gate that keeps connections open, for a test of values."""
    monkeypatch.setattr(gates, "MOST_FORGED", 10**9)
    monkeypatch.setattr(gates, "MOST_AT_ONCE", 1e9)
    monkeypatch.setattr(gates, "MOST_A_SECOND", 1e9)


@pytest.fixture
def server():
    """viser's own server behind a gate, with controls of every kind that the app has."""
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    server.gate = Gate(server)
    server.heard = []
    gui = server.gui
    with gui.add_folder("Shown") as server.folder:
        server.controls = {
            "list": gui.add_dropdown("list", ("a", "b")),
            "group": gui.add_button_group("group", ("a", "b")),
            "box": gui.add_checkbox("box", False),
            "text": gui.add_text("text", "a"),
            "number": gui.add_number("number", 2.0, min=1.0, max=5.0),
            "count": gui.add_number("count", 2, min=1, max=5),
            "slider": gui.add_slider("slider", 0.0, 1.0, 0.1, 0.5),
            "steps": gui.add_slider("steps", 0, 10, 1, 5),
            "pair": gui.add_vector2("pair", (1.0, 2.0), min=(0.0, 0.0), max=(9.0, 9.0)),
            "three": gui.add_vector3("three", (1.0, 2.0, 3.0)),
            "button": gui.add_button("button"),
            "file": gui.add_upload_button("file"),
        }
    for handle in server.controls.values():
        note = lambda event: server.heard.append(event.target)  # noqa: E731
        handle.on_upload(note) if hasattr(handle, "on_upload") else (
            handle.on_click(note) if hasattr(handle, "on_click") else handle.on_update(note)
        )
    yield server
    server.stop()


@pytest.fixture
def browser(server):
    with contextlib.closing(Connection(f"http://127.0.0.1:{server.get_port()}")) as one:
        wait_for(lambda: set(server.controls) <= set(one.uuids))
        yield one


GOOD = {
    "list": "b",
    "group": "b",
    "box": True,
    "text": "b é ✓ → 🙂",
    "number": 4,
    "count": 3,
    "slider": 0.7,
    "steps": 6,
    "pair": [3, 4],
    "three": [-1e3, 0.0, 2],
    "button": True,
}


@pytest.mark.parametrize("name", GOOD)
def test_what_a_hand_does_passes_and_forty_wrong_values_do_not(server, browser, patient, name):
    handle = server.controls[name]
    before = handle.value
    wrong = wrong_for(handle)
    assert len(wrong) >= 30
    for value in wrong:
        browser.set(name, value)
    settle(server, browser)
    assert handle.value == before
    assert not server.heard
    browser.set(name, GOOD[name])
    wait_for(lambda: server.heard == [handle])


@pytest.mark.parametrize("updates", PROPERTIES, ids=lambda one: "+".join(one) or "none")
def test_of_a_control_nothing_but_its_value_can_be_set(server, browser, updates):
    handle = server.controls["list"]
    state = dict(vars(handle._impl))
    browser.send(messages.GuiUpdateMessage(browser.uuids["list"][0], updates))
    settle(server, browser)
    assert dict(vars(handle._impl)) == state
    browser.set("list", "b")
    wait_for(lambda: handle.value == "b")


def settle(server, browser):
    """Wait until all that was sent before has been judged: a message of a name that is not there is, too."""
    counted = server.gate.dropped["forged CommandTriggerMessage"]
    browser.send(messages.CommandTriggerMessage("none"))
    wait_for(lambda: server.gate.dropped["forged CommandTriggerMessage"] > counted)


@pytest.mark.parametrize("hide", ["control", "folder", "disabled", "removed"])
def test_what_is_not_there_for_a_hand_is_not_there_for_anybody(server, browser, hide):
    handle = server.controls["list"]
    if hide == "control":
        handle.visible = False
    elif hide == "folder":
        server.folder.visible = False
    elif hide == "disabled":
        handle.disabled = True
    else:
        handle.remove()
    browser.set("list", "b")
    settle(server, browser)
    assert handle._impl.value == "a"
    if hide != "removed":  # the page is told what holds
        wait_for(lambda: browser.value("list") == "a")


@pytest.mark.parametrize(
    "message",
    [
        messages.ShareUrlRequest(),
        messages.ShareUrlDisconnect(),
        messages.GuiFormSubmitMessage("x"),
        messages.GuiButtonHoldMessage("x", 10.0),
        messages.GuiCloseModalMessage("x"),
        messages.RunJavascriptMessage("1"),
        messages.SceneNodeUpdateMessage("/x", {"visible": False}),
        messages.SceneNodeClickMessage("/x", None, (0.0,) * 3, (0.0,) * 3, (0.0, 0.0), None),
        messages.SceneNodeClickMessage("/x", 10**9, (0.0,) * 3, (float("nan"),) * 3, (0.0, 0.0), None),
        messages.ViewerCameraMessage(
            (1, 0, 0, 0), (float("nan"), 0, 0), 0.9, 0.1, 9.0, 6, 9, (0, 0, 0), (0, 0, 1)
        ),
        messages.ViewerCameraMessage((9, 0, 0, 0), (0, 0, 0), 0.9, 0.1, 9.0, 6, 9, (0, 0, 0), (0, 0, 1)),
        messages.ViewerCameraMessage((1, 0, 0, 0), (0, 0), 0.9, 0.1, 9.0, 6, 9, (0, 0, 0), (0, 0, 1)),
        messages.ViewerCameraMessage((1, 0, 0, 0), (0, 0, 0), 9.0, 0.1, 9.0, 6, 9, (0, 0, 0), (0, 0, 1)),
        messages.ScenePointerMessage("rect-select", None, None, ((0.0, 0.0), (1.0, 1.0)), None),
        messages.ScenePointerMessage("click", (0.0, 0.0, 0.0), (float("inf"), 0.0, 0.0), ((0.0, 0.0),), None),
        messages.TransformControlsUpdateMessage("/x", (1, 0, 0, 0), (1e300, 0, 0)),
        messages.TransformControlsDragStartMessage("/x"),
        messages.GetRenderResponseMessage(b"", "x"),
        messages.FileTransferStartUpload("x", "t", "name", "", 1, 1),
        messages.FileTransferPart(None, "t", 0, b"x"),
        messages.GuiUpdateMessage("x", {"value": 1}),
        messages.GuiUpdateMessage(["x"], {"value": 1}),
        messages.GuiUpdateMessage("x" * 100_000, {"value": 1}),
    ],
    ids=lambda one: type(one).__name__,
)
def test_a_message_that_nobody_awaits_is_dropped_and_counted(server, browser, message):
    before = server.gate.dropped.total()
    browser.send(message)
    wait_for(lambda: server.gate.dropped.total() == before + 1)
    assert not server.heard


def png_begin(width_px, height_px):
    """Begin of a PNG file of this size."""
    return PNG + b"\0\0\0\rIHDR" + struct.pack(">2I", width_px, height_px)


@pytest.mark.parametrize(
    ("payload", "verdict"),
    [
        (b"", "late"),  # the page could not draw
        (png_begin(1440, 8192), "late"),
        (png_begin(100_000, 100_000), "forged"),
        (png_begin(8193, 1), "forged"),
        (png_begin(1, 0), "forged"),
        (png_begin(1440, 900)[:20], "forged"),
        (b"II*\0" + png_begin(1440, 900), "forged"),
    ],
)
def test_only_pictures_that_can_be_decoded_without_harm_are_decoded(server, browser, payload, verdict):
    before = server.gate.dropped.copy()
    browser.send(messages.GetRenderResponseMessage(payload, "x"))
    wait_for(lambda: server.gate.dropped.total() == before.total() + 1)
    assert server.gate.dropped - before == {f"{verdict} GetRenderResponseMessage": 1}


def test_a_connection_that_keeps_sending_what_no_page_sends_is_closed(server, browser, caplog):
    with caplog.at_level(logging.WARNING, logger="app.web.gate"):
        for _ in range(MOST_FORGED):
            browser.send(messages.GuiUpdateMessage("x", {"removed": True}))
        wait_for(lambda: browser.lost)
    assert [record.levelname for record in caplog.records] == ["WARNING"]
    assert server.controls["list"].value == "a"


def test_a_flood_is_not_heard_but_the_hand_after_it_is(server, browser, monkeypatch):
    monkeypatch.setattr(gates, "MOST_AT_ONCE", 20.0)
    monkeypatch.setattr(gates, "MOST_A_SECOND", 0.0)
    for k in range(2000):
        browser.set("slider", (k % 10) / 10)
    wait_for(lambda: server.gate.dropped[FLOOD] >= 1980)  # more if the page greeted after the change
    monkeypatch.setattr(gates, "MOST_A_SECOND", 200.0)
    time.sleep(0.1)
    browser.set("list", "b")
    wait_for(lambda: server.controls["list"].value == "b")


def test_parts_of_no_file_are_counted_like_other_messages(server, browser, monkeypatch):
    monkeypatch.setattr(gates, "MOST_AT_ONCE", 20.0)
    monkeypatch.setattr(gates, "MOST_A_SECOND", 0.0)
    for k in range(100):
        browser.send(messages.FileTransferPart(None, f"{k}", 0, b""))
    wait_for(lambda: server.gate.dropped[FLOOD] >= 80)


def test_the_control_of_another_browser_is_nobody_elses(running):
    with connected(running.url, "Radius (mm)") as one, connected(running.url, "Radius (mm)") as other:
        mine, theirs = (page.uuids["Steps"][0] for page in (one, other))
        assert mine != theirs
        one.send(messages.GuiUpdateMessage(theirs, {"value": "Depth"}))
        one.go("Surface")
        wait_for(lambda: one.current == "Surface")
        assert other.current == "Scene"


def test_forty_wrong_values_change_no_control_of_any_screen_and_raise_nothing(running, patient, caplog):
    with connected(running.url, "Radius (mm)") as page:
        (session,) = running.sessions.values()
        controls = session.target.gui._gui_input_handle_from_uuid
        sent, seen = 0, set()
        for panel in session.panels:
            page.go(panel.title)
            wait_for(lambda panel=panel: page.current == panel.title)
            kinds = (*VALUES, viser.GuiUploadButtonHandle)
            inputs = [one for one in list(controls.values()) if isinstance(one, kinds)]
            for handle in [one for one in inputs if private.is_live(one)]:
                seen.add(handle._impl.uuid)
                sent += attack(running.viser_server, page, handle)
        wait_for(lambda: not session._thread._work_queue.qsize(), 60.0)
        assert not [note for note in page.notices if "unexpected" in note]
        assert not [record for record in caplog.records if record.exc_info]
        assert not page.lost
        assert len(seen) > 100
        assert sent > 40 * len(seen)


def attack(server, page, handle):
    """Send all that is wrong for a control; its value and its state are as before."""
    before = handle._impl.value
    callbacks = list(handle._impl.update_cb)
    for value in wrong_for(handle):
        page.send(messages.GuiUpdateMessage(handle._impl.uuid, {"value": value}))
    for updates in PROPERTIES:
        page.send(messages.GuiUpdateMessage(handle._impl.uuid, updates))
    settle(server, page)
    count = len(wrong_for(handle)) + len(PROPERTIES)
    assert handle._impl.value is before or handle._impl.value == before
    assert handle._impl.update_cb == callbacks
    assert not handle._impl.removed
    return count

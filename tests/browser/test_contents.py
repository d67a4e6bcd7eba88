"""The page's script that fetches what messages name, with a made-up connection."""

from pathlib import Path

import numpy as np
import pytest

import app
from app.drawing.packing import pack, rounded
from tests.app.drawing.test_packing import FILES
from tests.browser.hands import PATIENCE_MS

HOME = Path(app.__file__).parent
PAGE = """<!doctype html><meta charset="utf-8"><script>
window.notices = [];
window.packetmesh = {notice: sentence => notices.push(sentence)};
</script><script src="packing.js"></script><script src="contents.js"></script><script>
window.got = [];
const source = "onmessage = event => postMessage(event.data)";
const worker = new Worker(URL.createObjectURL(new Blob([source], {type: "text/javascript"})));
worker.onmessage = ({data}) => {
  if (data.type === "connected") got.length = 0; // what was still on its way belongs to the last connection
  got.push(...data.type === "message_batch" ? data.messages : [data]);
};
window.send = (...messages) => worker.postMessage({type: "message_batch", messages});
window.connect = () => worker.postMessage({type: "connected"});
</script>"""
ADDRESS = "http://packetmesh.test/"
CONTENT = {"a": b"first", "b": b"second", "c": b"third", "a?coarse": b"few", "b?coarse": b"less"}
RAW = {"dtype": "", "bytes": 5}


@pytest.fixture(scope="module")
def tab(browser):
    context = browser.new_context()
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    yield page
    context.close()


class Line:
    """What the server of the page is asked for, and how it answers."""

    def __init__(self):
        self.asked, self.refusals, self.held = [], [], []

    def answer(self, route):
        name = route.request.url.removeprefix(ADDRESS).partition("?")[0]
        if name in ("", "packing.js", "contents.js"):
            text = {
                "packing.js": HOME / "drawing" / "packing.js",
                "contents.js": HOME / "web" / "contents.js",
            }
            return route.fulfill(
                body=text[name].read_text() if name else PAGE,
                content_type="text/javascript" if name else "text/html",
            )
        name = route.request.url.removeprefix(f"{ADDRESS}contents/")
        self.asked.append(name)
        if name in self.held:
            return None  # never answered
        status = self.refusals.pop(0) if self.refusals else 200
        if status != 200:
            return route.fulfill(status=status)
        if name not in CONTENT:
            return route.fulfill(status=404)
        content = CONTENT[name]
        return route.fulfill(body=b'\x0d\0\0\0[["other",1]]x' if content is None else pack(content))


@pytest.fixture
def page(tab):
    tab.line = Line()
    tab.unroute_all()
    tab.route("**/*", tab.line.answer)
    tab.goto(ADDRESS)
    connect(tab)
    return tab


def connect(page):
    page.evaluate("() => { got.length = 0; connect(); }")
    page.wait_for_function("() => got[0]?.type === 'connected'")


def named(name, **kind):
    return {"packetmesh": name, **RAW, **kind}


def create(name, content):
    return {"type": "GlbMessage", "name": name, "props": {"glb_data": named(content), "scale": 1}}


def visible(name, shown):
    return {"type": "SetSceneNodeVisibilityMessage", "name": name, "visible": shown}


def send(page, *messages):
    page.evaluate("messages => send(...messages)", list(messages))


SEEN = """() => {
  const text = value => ArrayBuffer.isView(value) ? new TextDecoder().decode(value) : value;
  const read = one =>
    one && Object.fromEntries(Object.entries(one).map(([key, value]) => [key, text(value)]));
  return got.slice(1).map(one => [
    one.type, one.name ?? one.uuid ?? null, read(one.props ?? one.updates) ?? one.visible ?? null,
  ]);
}"""


def seen(page, count):
    """The messages that viser's page got, once there are so many."""
    page.wait_for_function(f"() => got.length >= {count + 1}")
    page.wait_for_timeout(100)
    found = page.evaluate(SEEN)
    assert len(found) == count, found
    return found


DONE = {"type": "ReplayDoneMessage"}


def test_a_message_gets_its_content_and_those_after_it_wait(page):
    send(page, create("/mesh", "a"))
    send(page, DONE)
    assert seen(page, 2) == [
        ["GlbMessage", "/mesh", {"glb_data": "first", "scale": 1}],
        ["ReplayDoneMessage", None, None],
    ]
    assert page.line.asked == ["a"]


def test_what_is_hidden_is_fetched_when_it_is_shown_and_before_it_is_shown(page):
    send(page, visible("/fuse", False), create("/fuse/mesh", "a"), create("/mesh", "b"))
    send(page, {"type": "SetPositionMessage", "name": "/fuse/mesh", "position": [1, 2, 3]}, DONE)
    assert [row[:2] for row in seen(page, 3)] == [
        ["SetSceneNodeVisibilityMessage", "/fuse"],
        ["GlbMessage", "/mesh"],
        ["ReplayDoneMessage", None],
    ]
    assert page.line.asked == ["b"]
    send(page, visible("/fuse", True))
    assert [row[:2] for row in seen(page, 6)[3:]] == [
        ["GlbMessage", "/fuse/mesh"],
        ["SetPositionMessage", "/fuse/mesh"],
        ["SetSceneNodeVisibilityMessage", "/fuse"],
    ]
    assert page.line.asked == ["b", "a"]


def test_a_node_that_is_hidden_in_the_same_batch_is_not_fetched(page):
    send(page, create("/mesh", "a"), visible("/mesh", False), DONE)
    assert [row[0] for row in seen(page, 1)] == ["ReplayDoneMessage"]
    send(page, visible("/mesh", True))
    assert [row[2] for row in seen(page, 4)[1:]] == [{"glb_data": "first", "scale": 1}, False, True]


def test_what_is_replaced_or_removed_while_hidden_is_never_fetched(page):
    send(page, visible("/fuse", False), create("/fuse/old", "a"), create("/fuse/new", "a"))
    send(page, {"type": "RemoveSceneNodeMessage", "name": "/fuse/old"})
    send(page, {"type": "SceneNodeUpdateMessage", "name": "/fuse/new", "updates": {"glb_data": named("b")}})
    send(page, visible("/fuse", True))
    found = seen(page, 4)
    assert found[1] == ["RemoveSceneNodeMessage", "/fuse/old", None]  # which viser ignores
    assert found[2] == ["GlbMessage", "/fuse/new", {"glb_data": "second", "scale": 1}]
    assert page.line.asked == ["b"]


def test_a_known_node_that_changes_while_hidden_is_removed(page):
    send(page, create("/fuse/mesh", "a"))
    send(page, visible("/fuse", False))
    update = {"type": "SceneNodeUpdateMessage", "name": "/fuse/mesh"}
    send(page, {**update, "updates": {"glb_data": named("b")}})
    send(page, {**update, "updates": {"glb_data": named("c")}})
    send(page, {"type": "RemoveSceneNodeMessage", "name": "/fuse/mesh"}, DONE)
    assert [row[0] for row in seen(page, 4)] == [
        "GlbMessage",
        "SetSceneNodeVisibilityMessage",
        "RemoveSceneNodeMessage",
        "ReplayDoneMessage",
    ]
    assert page.line.asked == ["a"]


def test_pictures_of_a_hidden_folder_wait_for_it(page):
    folder = {"type": "GuiFolderMessage", "uuid": "f", "container_uuid": "root", "props": {"visible": False}}
    picture = {"type": "GuiImageMessage", "uuid": "p", "container_uuid": "f"}
    send(page, folder, {**picture, "props": {"_data": named("a"), "visible": True}}, DONE)
    assert [row[:2] for row in seen(page, 2)] == [["GuiFolderMessage", "f"], ["ReplayDoneMessage", None]]
    send(page, {"type": "GuiUpdateMessage", "uuid": "f", "updates": {"visible": True}})
    assert seen(page, 4)[2:] == [
        ["GuiImageMessage", "p", {"_data": "first", "visible": True}],
        ["GuiUpdateMessage", "f", {"visible": True}],
    ]


def test_for_a_content_that_is_gone_the_page_connects_anew_and_the_second_time_says_so(page):
    send(page, create("/mesh", "gone"), DONE)
    assert seen(page, 1) == [["retry", None, None]]
    connect(page)
    send(page, create("/mesh", "gone"))
    send(page, create("/other", "a"), DONE)
    assert [row[:2] for row in seen(page, 2)] == [["GlbMessage", "/other"], ["ReplayDoneMessage", None]]
    assert page.evaluate("notices") == ["A part of the page did not arrive: reload it."]


def test_a_hidden_content_that_is_gone_is_asked_for_once(page):
    send(
        page, visible("/fuse", False), create("/fuse/x", "gone"), create("/fuse/y", "a"), create("/mesh", "b")
    )
    seen(page, 2)
    page.wait_for_timeout(4500)
    assert page.line.asked == ["b", "gone", "a"]


def test_a_content_of_another_packing_is_asked_for_anew_and_then_given_up(page, monkeypatch):
    """Such as one that the browser has kept since another version of the program."""
    monkeypatch.setitem(CONTENT, "old", None)
    send(page, create("/mesh", "old"))
    page.wait_for_function("() => got.some(one => one.type === 'retry')")
    assert page.line.asked == ["old"] * 4


def test_what_replaces_a_known_node_while_hidden_goes_with_it(page):
    send(page, create("/fuse/mesh", "a"))
    seen(page, 1)
    send(page, visible("/fuse", False), create("/fuse/mesh", "b"))
    send(page, {"type": "RemoveSceneNodeMessage", "name": "/fuse/mesh"})
    send(page, visible("/fuse", True))
    assert [row[0] for row in seen(page, 4)[1:]] == [
        "SetSceneNodeVisibilityMessage",
        "RemoveSceneNodeMessage",
        "SetSceneNodeVisibilityMessage",
    ]
    assert page.line.asked == ["a"]


def test_of_equal_messages_to_a_held_node_the_last_counts(page):
    send(page, visible("/fuse", False), create("/fuse/mesh", "a"))
    for x in range(50):
        send(page, {"type": "SetPositionMessage", "name": "/fuse/mesh", "position": [x, 0, 0]})
    send(page, visible("/fuse", True))
    assert [row[0] for row in seen(page, 4)[1:]] == [
        "GlbMessage",
        "SetPositionMessage",
        "SetSceneNodeVisibilityMessage",
    ]
    assert page.evaluate("got[3].position") == [49, 0, 0]


def test_a_browsers_own_anchor_of_a_shared_node_changes_nothing(page):
    send(page, visible("/fuse", False), create("/fuse/mesh", "a"))
    anchor = {"type": "FrameMessage", "props": {}, "virtual": True, "owner": "7"}
    send(page, {**anchor, "name": "/fuse"}, {**anchor, "name": "/fuse/mesh"})
    seen(page, 3)
    send(page, visible("/fuse", True))
    assert seen(page, 5)[3][2] == {"glb_data": "first", "scale": 1}


def test_a_busy_server_is_asked_again(page):
    page.line.refusals = [503, 503]
    send(page, create("/mesh", "a"))
    assert seen(page, 1)[0][2]["glb_data"] == "first"
    assert page.line.asked == ["a"] * 3
    assert page.evaluate("notices") == []


def test_when_the_line_is_idle_hidden_contents_are_fetched_ahead(page):
    send(page, visible("/fuse", False), create("/fuse/mesh", "a"), create("/mesh", "b"))
    seen(page, 2)
    page.wait_for_timeout(4000)
    assert page.line.asked == ["b", "a"]
    send(page, visible("/fuse", True))
    assert seen(page, 4)[2][2] == {"glb_data": "first", "scale": 1}
    assert page.line.asked == ["b", "a"]


def test_a_new_connection_forgets_the_old_one(page):
    send(page, visible("/fuse", False), create("/fuse/mesh", "a"))
    connect(page)
    send(page, create("/fuse/mesh", "b"))
    assert seen(page, 1) == [["GlbMessage", "/fuse/mesh", {"glb_data": "second", "scale": 1}]]


def test_a_new_connection_ends_the_fetches_of_the_old_one(page):
    ended = []
    page.on("requestfailed", lambda request: ended.append(request.url.removeprefix(f"{ADDRESS}contents/")))
    page.line.held = ["a"]
    send(page, create("/mesh", "a"))
    page.wait_for_timeout(200)
    assert ended == []
    connect(page)
    page.line.held = []
    send(page, create("/mesh", "b"))
    assert seen(page, 1)[0][2]["glb_data"] == "second"
    assert ended == ["a"]
    page.wait_for_timeout(1500)  # longer than the pause before another try
    assert page.line.asked == ["a", "b"]
    assert page.evaluate("notices") == []


def test_the_first_screen_waits_for_the_one_that_the_address_names(page):
    page.goto(f"{ADDRESS}?screen=fuse")
    connect(page)
    send(page, create("/scene/cloud", "a"), visible("/scene", True), visible("/fuse", False))
    send(page, create("/fuse/mesh", "b"))
    assert len(seen(page, 2)) == 2
    assert page.line.asked == []
    send(page, visible("/scene", False), visible("/fuse", True))
    assert [row[:2] for row in seen(page, 5)[2:]] == [
        ["GlbMessage", "/fuse/mesh"],
        ["SetSceneNodeVisibilityMessage", "/scene"],
        ["SetSceneNodeVisibilityMessage", "/fuse"],
    ]
    assert page.line.asked == ["b"]


SLOW = """() => {
  const found = performance.getEntriesByType;
  performance.getEntriesByType = kind => kind === "navigation"
    ? [{transferSize: 600000, responseStart: 0, responseEnd: 6000}] : found.call(performance, kind);
}"""


@pytest.fixture
def slow(browser):
    """A page that came at 100 kB/s."""
    context = browser.new_context()
    tab = context.new_page()
    tab.set_default_timeout(PATIENCE_MS)
    tab.line = Line()
    tab.route("**/*", tab.line.answer)
    tab.add_init_script(f"({SLOW})()")
    tab.goto(ADDRESS)
    connect(tab)
    yield tab
    context.close()


def large(name, content):
    return {
        "type": "GlbMessage",
        "name": name,
        "owner": "",
        "props": {"glb_data": named(content, coarse=True)},
    }


def test_on_a_slow_line_the_coarse_copy_comes_first_and_then_the_whole(slow):
    send(slow, large("/surface/mesh-1", "a"), DONE)
    assert [row[::2] for row in seen(slow, 3)] == [
        ["GlbMessage", {"glb_data": "few"}],
        ["ReplayDoneMessage", None],
        ["SceneNodeUpdateMessage", {"glb_data": "first"}],
    ]
    assert slow.line.asked == ["a?coarse", "a"]
    assert slow.evaluate("notices") == ["A coarse surface, until the whole one has arrived.", ""]


def test_where_a_mesh_is_there_the_next_one_comes_whole(slow):
    send(slow, large("/surface/mesh-1", "a"))
    seen(slow, 2)
    send(slow, large("/surface/mesh-2", "b"))
    assert seen(slow, 3)[2] == ["GlbMessage", "/surface/mesh-2", {"glb_data": "second"}]
    send(slow, {"type": "RemoveSceneNodeMessage", "name": "/surface/mesh-1"})
    send(slow, {"type": "RemoveSceneNodeMessage", "name": "/surface/mesh-2"})
    send(slow, large("/surface/mesh-3", "a"))
    assert [row[2] for row in seen(slow, 7)[5:]] == [{"glb_data": "few"}, {"glb_data": "first"}]


def test_a_mesh_that_is_removed_is_not_refined(slow):
    slow.line.refusals = [200, 503]
    send(slow, large("/surface/mesh-1", "a"))
    slow.wait_for_function("() => got.length === 2")
    send(
        slow, visible("/surface/mesh-1", True), {"type": "RemoveSceneNodeMessage", "name": "/surface/mesh-1"}
    )
    slow.wait_for_timeout(2500)
    assert slow.line.asked == ["a?coarse", "a", "a"]
    assert [row[0] for row in slow.evaluate(SEEN)] == [
        "GlbMessage",
        "SetSceneNodeVisibilityMessage",
        "RemoveSceneNodeMessage",
    ]


def test_on_a_slow_line_nothing_is_fetched_ahead(slow):
    send(slow, visible("/fuse", False), create("/fuse/mesh", "a"), create("/mesh", "b"))
    seen(slow, 2)
    slow.wait_for_timeout(3500)
    assert slow.line.asked == ["b"]


def test_on_a_quick_line_the_whole_comes_at_once(page):
    send(page, large("/surface/mesh-1", "a"), DONE)
    assert seen(page, 2)[0][2] == {"glb_data": "first"}
    assert page.line.asked == ["a"]


NUMBERS = np.random.default_rng(0)
ARRAYS = {
    "half": NUMBERS.normal(size=(50, 3)).astype("<f2"),
    "floats": NUMBERS.normal(size=(50, 3)).astype("<f4"),
    "grid": rounded(NUMBERS.normal(size=(50, 3))),
    "colours": NUMBERS.integers(0, 256, (50, 3), dtype=np.uint8),
    "indices": NUMBERS.integers(0, 1 << 32, (50, 3), dtype=np.uint32),
    "doubles": NUMBERS.normal(size=(5, 3)),
    "none": np.empty((0, 3), "<f4"),
}
UNPACKED = """packed => Array.from(packetmeshUnpack(Uint8Array.from(packed)))"""


@pytest.mark.parametrize("name", [*FILES, *ARRAYS])
def test_the_page_unpacks_to_the_bit(page, name):
    content = FILES[name] if name in FILES else ARRAYS[name]
    raw = content if isinstance(content, bytes) else content.tobytes()
    assert bytes(page.evaluate(UNPACKED, list(pack(content)))) == raw


@pytest.mark.parametrize(("name", "kind"), [("half", "Uint16Array"), ("floats", "Float32Array")])
def test_an_array_gets_its_type(page, monkeypatch, name, kind):
    monkeypatch.setitem(CONTENT, name, ARRAYS[name])
    cloud = {"type": "PointCloudMessage", "name": "/cloud"}
    send(page, {**cloud, "props": {"points": named(name, dtype=ARRAYS[name].dtype.str)}})
    page.wait_for_function("() => got.length === 2")
    found = page.evaluate("() => [got[1].props.points.constructor.name, Array.from(got[1].props.points)]")
    expected = ARRAYS[name].view("<u2") if name == "half" else ARRAYS[name]
    assert found == [kind, expected.ravel().tolist()]

"""What a page draws: named in its messages, fetched over HTTP, and only by the browser that it is for."""

import contextlib
import gzip
import http.client
import re
import socket
import threading

import numpy as np
import pytest
import trimesh
import viser
from websockets.asyncio import server as websockets_server

from app.drawing.coarse import coarse_glb, is_mesh
from app.drawing.glb import lines_glb, mesh_glb
from app.drawing.packing import pack
from app.load.connection import Connection, wait_for
from app.web import contents as module
from app.web.contents import (
    COOKIE,
    FEWEST_BYTES,
    FEWEST_CHANGED_BYTES,
    FOLDER,
    GONE,
    SLOWEST_S,
    Contents,
    Packing,
    offer_contents,
    page_cookie,
)
from app.web.headers import strict_headers
from tests.app.packed import unpacked

HERS, HIS = f"{COOKIE}={'a' * 22}", f"{COOKIE}={'b' * 22}"
LARGE = lines_glb(np.random.default_rng(0).uniform(-1, 1, (3000, 2, 3)), (213, 40, 30))
PACKING = Packing(pack, is_mesh, coarse_glb)
SPHERE = trimesh.creation.icosphere(subdivisions=6)
MESH = mesh_glb(
    np.asarray(SPHERE.vertices), np.asarray(SPHERE.faces), np.full((len(SPHERE.vertices), 3), 9, "u1")
)
POINTS = np.random.default_rng(1).uniform(-1, 1, (4000, 3)).astype(np.float32)


class Counting:
    """Packs as the app does, and counts."""

    def __init__(self):
        self.packed, self.began, self.fails = 0, False, False
        self.may_go_on = threading.Event()
        self.may_go_on.set()

    def __call__(self, data):
        self.began = True
        assert self.may_go_on.wait(20.0)
        if self.fails:
            raise ValueError("not now")
        self.packed += 1
        return pack(data)


@pytest.fixture
def served():
    packing = Counting()
    contents = Contents(Packing(packing, is_mesh, coarse_glb))
    with strict_headers(), contents.served():
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    offer_contents(server, contents)
    yield server, packing
    contents.close()
    server.stop()


@contextlib.contextmanager
def page(server, cookie=""):
    with contextlib.closing(Listener(f"http://127.0.0.1:{server.get_port()}", cookie)) as one:
        yield one


class Listener(Connection):
    """Keeps the messages."""

    def __init__(self, *arguments):
        self.named, self.parts = {}, []
        super().__init__(*arguments)

    def _take_message(self, message):
        if message["type"] == "FileTransferPart":
            self.parts.append(message["content"])
        for key, value in (message.get("props") or message.get("updates") or {}).items():
            if key in ("glb_data", "points"):
                self.named[message["name"], key] = value
        super()._take_message(message)


def get(server, path, cookie=""):
    with contextlib.closing(http.client.HTTPConnection("127.0.0.1", server.get_port(), timeout=10)) as one:
        one.request("GET", path, headers={"Cookie": cookie} if cookie else {})
        answer = one.getresponse()
        return answer.status, dict(answer.headers), answer.read()


def draw(server):
    server.scene.add_glb("/mesh", LARGE)
    server.scene.add_point_cloud("/cloud", POINTS, np.zeros(3, np.uint8), precision="float32")
    server.scene.add_glb("/small", LARGE[:100])


def test_a_page_with_the_cookie_gets_names_and_fetches_the_same_bytes(served):
    server, packing = served
    draw(server)
    with page(server, HERS) as one:
        wait_for(lambda: len(one.named) == 3)
        assert one.named["/small", "glb_data"] == LARGE[:100]
        for key, data, kind in (
            (("/mesh", "glb_data"), LARGE, ""),
            (("/cloud", "points"), POINTS.tobytes(), "<f4"),
        ):
            told = one.named[key]
            assert told["dtype"] == kind
            status, headers, body = get(server, FOLDER + told["packetmesh"], HERS)
            assert status == 200
            assert "immutable" in headers["Cache-Control"]
            assert "private" in headers["Cache-Control"]
            assert "default-src 'none'" in headers["Content-Security-Policy"]
            assert len(body) < len(data)
            assert unpacked(gzip.decompress(body)) == data
    assert packing.packed == 2


def test_a_large_mesh_has_a_coarse_copy(served):
    server, packing = served
    server.scene.add_glb("/mesh", MESH)
    server.scene.add_glb("/lines", lines_glb(np.zeros((30_000, 2, 3)), (1, 2, 3)))
    with page(server, HERS) as one:
        wait_for(lambda: len(one.named) == 2)
        assert one.named["/mesh", "glb_data"]["coarse"]
        assert not one.named["/lines", "glb_data"]["coarse"]
        path = FOLDER + one.named["/mesh", "glb_data"]["packetmesh"]
        whole, coarse = (gzip.decompress(get(server, path + query, HERS)[2]) for query in ("", "?coarse"))
        assert unpacked(whole) == MESH
        assert unpacked(coarse) == coarse_glb(MESH)
        assert len(coarse) < 0.7 * len(whole)
        assert len(gzip.compress(coarse)) < len(gzip.compress(whole))
        assert get(server, path + "?coarse", HIS)[0] == 404
        lines = FOLDER + one.named["/lines", "glb_data"]["packetmesh"]
        assert get(server, lines + "?coarse", HERS)[0] == 404  # it has none
    assert packing.packed == 2


def test_a_browser_that_goes_while_its_content_is_packed_takes_it_from_no_other(served):
    server, packing = served
    packing.may_go_on.clear()
    draw(server)
    with page(server, HERS) as one:
        wait_for(lambda: len(one.named) == 3)
        path = FOLDER + one.named["/mesh", "glb_data"]["packetmesh"]
        with socket.create_connection(("127.0.0.1", server.get_port())) as gone:
            gone.sendall(f"GET {path} HTTP/1.1\r\nHost: x\r\nCookie: {HERS}\r\n\r\n".encode())
            wait_for(lambda: packing.began)
        threading.Timer(0.5, packing.may_go_on.set).start()
        assert get(server, path, HERS)[0] == 200
    assert packing.packed == 1


def test_a_content_that_could_not_be_packed_is_packed_when_it_is_asked_for_again(served):
    server, packing = served
    draw(server)
    with page(server, HERS) as one:
        wait_for(lambda: len(one.named) == 3)
        path = FOLDER + one.named["/mesh", "glb_data"]["packetmesh"]
        packing.fails = True
        assert get(server, path, HERS)[0] == 500
        packing.fails = False
        assert get(server, path, HERS)[0] == 200


def test_parts_of_downloads_are_sent_as_they_are(served):
    server, packing = served
    with page(server, HERS) as one:
        wait_for(lambda: bool(server.get_clients()))
        (client,) = server.get_clients().values()
        client.send_file_download("run.zip", bytes(3_000_000))
        wait_for(lambda: sum(map(len, one.parts)) == 3_000_000)
    assert packing.packed == 0


def test_a_slow_browser_has_its_time():
    """Websockets would give it ten seconds for all of its request."""
    given = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(websockets_server, "serve", lambda *_, **options: given.append(options))
        with Contents(PACKING).served():
            websockets_server.serve(process_request=None, open_timeout=10.0)
    assert (given[0]["open_timeout"], given[0]["close_timeout"]) == (SLOWEST_S, SLOWEST_S)


def test_a_page_without_the_cookie_gets_the_data_themselves(served):
    server, packing = served
    draw(server)
    with page(server) as one:
        wait_for(lambda: len(one.named) == 3)
        assert one.named["/mesh", "glb_data"] == LARGE
        assert "__binary_index" in one.named["/cloud", "points"]
    assert packing.packed == 0


def test_many_browsers_get_the_same_name_and_it_is_packed_once(served):
    server, packing = served
    draw(server)
    cookies = [f"{COOKIE}={number:022}" for number in range(5)]
    with contextlib.ExitStack() as stack:
        pages = [stack.enter_context(page(server, cookie)) for cookie in cookies]
        wait_for(lambda: all(len(one.named) == 3 for one in pages))
        (name,) = {one.named["/mesh", "glb_data"]["packetmesh"] for one in pages}
        found = []
        threads = [
            threading.Thread(target=lambda cookie=cookie: found.append(get(server, FOLDER + name, cookie)[0]))
            for cookie in cookies
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert found == [200] * 5
    assert packing.packed == 1


def test_a_content_of_another_browser_is_refused_like_one_that_is_gone(served):
    server, _ = served
    with page(server, HERS) as hers, page(server, HIS) as his:
        wait_for(lambda: len(server.get_clients()) == 2)
        (her_client,) = [
            client for number, client in server.get_clients().items() if number == min(server.get_clients())
        ]
        her_client.scene.add_glb("/private", LARGE)
        wait_for(lambda: bool(hers.named) or bool(his.named))
        owner, other = (HERS, HIS) if hers.named else (HIS, HERS)
        name = (hers.named or his.named)["/private", "glb_data"]["packetmesh"]
        assert get(server, FOLDER + name, owner)[0] == 200
        refusals = [
            get(server, FOLDER + name, other),
            get(server, FOLDER + name),
            get(server, FOLDER + "0" * 32, owner),
            get(server, FOLDER + "../x", owner),
            get(server, FOLDER, owner),
        ]
        assert {(status, body.decode()) for status, _, body in refusals} == {(404, GONE)}
    wait_for(lambda: not server.get_clients())
    wait_for(lambda: get(server, FOLDER + name, owner)[0] == 404)  # nobody shows it any more


def test_a_browser_keeps_its_newest_contents(monkeypatch):
    monkeypatch.setattr(module, "MOST_BYTES", 3 * FEWEST_BYTES)
    contents = Contents(PACKING)
    contents.opened(1, HERS)
    datas = [bytes([number]) * FEWEST_BYTES for number in range(4)]
    names = [contents.offer(1, data)["packetmesh"] for data in datas]
    (offered,) = contents._offered.values()
    assert list(offered) == names[1:]
    assert set(contents._known) == set(names[1:])
    assert contents.offer(1, datas[1])["packetmesh"] == names[1]
    assert contents.offer(1, bytes(FEWEST_BYTES - 1)) is None
    assert contents.offer(2, datas[1]) is None
    contents._offered["a" * 22][names[3]] = True  # fetched: the browser keeps it
    contents.offer(1, datas[0])
    assert set(contents._known) == {names[0], names[1], names[2]}
    contents.closed(1)
    assert not contents._known
    assert not contents._names
    assert contents.offer(1, datas[1]) is None


def test_small_changes_stay_in_their_messages():
    contents = Contents(PACKING)
    contents.opened(1, HERS)
    assert contents.offer(1, bytes(FEWEST_BYTES)) is not None
    assert contents.offer(1, bytes(FEWEST_CHANGED_BYTES - 1), of_new=False) is None
    assert contents.offer(1, bytes(FEWEST_CHANGED_BYTES), of_new=False) is not None


def test_the_server_tells_what_is_new_from_what_changes(served):
    server, _ = served
    with page(server, HERS) as one:
        handle = server.scene.add_point_cloud(
            "/cloud", POINTS[:1000], np.zeros(3, np.uint8), precision="float32"
        )
        wait_for(lambda: len(one.named) == 1)
        assert "packetmesh" in one.named["/cloud", "points"]
        handle.points = POINTS[1000:2000]
        wait_for(lambda: "__binary_index" in one.named["/cloud", "points"])
        handle.points = POINTS
        wait_for(lambda: "packetmesh" in one.named["/cloud", "points"])


def test_equal_bytes_of_another_kind_have_another_name():
    contents = Contents(PACKING)
    contents.opened(1, HERS)
    array = np.zeros((FEWEST_BYTES, 2), np.uint16)
    others = [array, array.astype(np.int16), array.reshape(-1, 4), array.tobytes()]
    assert len({contents.offer(1, one)["packetmesh"] for one in others}) == 4


def test_an_array_that_changes_gets_another_name_and_the_first_stays():
    contents = Contents(PACKING)
    contents.opened(1, HERS)
    array = np.zeros((FEWEST_BYTES, 3), np.uint8)
    before = contents.offer(1, array)["packetmesh"]
    array[0] = 1
    assert contents.offer(1, array)["packetmesh"] != before
    packed = contents._known[before].packed(contents._packer, PACKING, coarse=False).result()
    assert unpacked(gzip.decompress(packed)) == bytes(3 * FEWEST_BYTES)


def test_beyond_the_limit_of_all_data_stay_in_their_messages(monkeypatch):
    monkeypatch.setattr(module, "MOST_OF_ALL_BYTES", 2 * FEWEST_BYTES)
    contents = Contents(PACKING)
    for number in range(3):
        contents.opened(number, f"{COOKIE}={number:022}")
    datas = [bytes([number]) * FEWEST_BYTES for number in range(3)]
    assert [contents.offer(number, data) is None for number, data in enumerate(datas)] == [False, False, True]
    assert contents.offer(2, datas[0]) is not None  # which is there
    contents.closed(1)
    assert contents.offer(2, datas[2]) is not None


def test_of_fetched_contents_only_few_are_kept(monkeypatch):
    monkeypatch.setattr(module, "FETCHED_BYTES", 2 * FEWEST_BYTES)
    contents = Contents(PACKING)
    contents.opened(1, HERS)
    names = [contents.offer(1, bytes([number]) * FEWEST_BYTES)["packetmesh"] for number in range(4)]
    (offered,) = contents._offered.values()
    for name in names:
        offered[name] = True
    newest = contents.offer(1, bytes([9]) * FEWEST_BYTES)["packetmesh"]
    assert list(offered) == [*names[2:], newest]


def test_the_page_gives_each_browser_a_cookie_of_its_own_once():
    given = [page_cookie("") for _ in range(2)]
    assert len(set(given)) == 2
    for one in given:
        assert re.fullmatch(rf"{COOKIE}=[A-Za-z0-9_-]{{22}}; Path=/; HttpOnly; SameSite=Lax", one)
        assert page_cookie(one.partition(";")[0]) == ""
    one = page_cookie("").partition(";")[0]
    for others in ("a=1; {}", 'a={{"x": 1}}; {}; b=2', "{}; x=<"):
        assert page_cookie(others.format(one)) == ""
    for broken in (f"{COOKIE}=short", f"{COOKIE}={'<' * 22}", 'x="', f"{COOKIE}="):
        assert page_cookie(broken) != ""

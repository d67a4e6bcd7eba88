"""No path that comes from a browser, an archive or a file leads out of its folder."""

import contextlib
import sys
from pathlib import Path

import pytest
from viser import _messages as messages

sys.path.insert(0, str(Path(__file__).parent))
from attacker import connected

from app.load.connection import wait_for
from app.screens.calibrate.uploads import keep_photographs
from app.server import build_server
from app.web.uploads import keep_upload
from packetmesh.errors import InputError
from packetmesh.files import path_below
from tests.bad_input.makers import zipped
from tests.bad_input.samples import RGB, opencv

pytestmark = pytest.mark.xdist_group("attack")
PNG = opencv(RGB, ".png")
OUTSIDE = (
    *("/tmp/attack", "..", "../x", "a/../../x", "\\\\host\\x", "..\\x", "C:\\x", "c:x", "", "a\0b"),
    *("a/..", "./..", "//x"),
)


class File:
    """What viser gives for an upload."""

    def __init__(self, name, content=PNG):
        self.name, self.content = name, content


@pytest.mark.parametrize("name", OUTSIDE)
def test_a_name_that_leaves_its_folder_is_refused(tmp_path, name):
    for names in ((name,), ("node_00", name), (name, "color.png")):
        with pytest.raises(InputError, match="does not name a file below"):
            path_below(tmp_path, *names)


def test_a_name_below_a_folder_is_joined(tmp_path):
    with pytest.raises(InputError):
        path_below(tmp_path, ".")
    assert path_below(tmp_path, "node_00", "a..b.png") == tmp_path / "node_00" / "a..b.png"
    assert path_below(tmp_path, "x/y") == tmp_path / "x" / "y"


@pytest.mark.parametrize("node", OUTSIDE)
def test_no_camera_name_sends_a_photograph_elsewhere(tmp_path, node):
    folder = tmp_path / "uploads" / "photographs"
    with pytest.raises(InputError):
        keep_photographs(File("a.png"), folder, node)
    with pytest.raises(InputError):
        keep_photographs(File("a.zip", zipped({"a.png": PNG})), folder, node)
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


@pytest.mark.parametrize("name", [*OUTSIDE, "../node_00/../../x.png", "node_01/../../x.png"])
def test_no_file_name_leads_out_of_an_upload(tmp_path, name):
    folder = tmp_path / "uploads" / "one"
    keep_upload(File(name), folder, 1 << 20, "")
    for make in (lambda: File(f"{name}/c.png"), lambda: File("a.zip", zipped({f"{name}/c.png": PNG}))):
        with contextlib.suppress(InputError):  # or its last part is taken as its name
            keep_photographs(make(), folder, "node_00")
    written = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert written
    assert all(folder in path.resolve().parents for path in written)


def test_a_browser_cannot_make_a_list_name_a_folder(tmp_path):
    """The list says whose camera took a photograph; its value became a folder."""
    app = build_server("box-on-table", port=0)
    try:
        with connected(app.url, "Taken by") as page:
            page.go("Calibrate")
            wait_for(lambda: page.current == "Calibrate")
            for target in (str(tmp_path / "stolen"), "../../stolen"):
                page.set("Taken by", target)
            (button,) = page.uuids["Photograph or ZIP …"]
            page.send(messages.FileTransferStartUpload(button, "t", "a.png", "image/png", 1, len(PNG)))
            page.send(messages.FileTransferPart(button, "t", 0, PNG))
            wait_for(lambda: page.reads("**1 photograph**"))
            kept = [path for path in Path(app.folder.path).rglob("*.png") if path.stat().st_size == len(PNG)]
            assert [path.parent.name for path in kept] == ["node_00"]
        assert not list(tmp_path.iterdir())
    finally:
        app.stop()

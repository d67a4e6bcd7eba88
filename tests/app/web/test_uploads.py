"""Uploads have a name that cannot be guessed, and stay while somebody has them open, and a while longer."""

from types import SimpleNamespace

import pytest

from app.web import uploads as module
from app.web.uploads import KEPT_S, OWN, Uploads, keep_upload, name_in, plain
from packetmesh.errors import InputError
from pipeline.sources import Calibrated, Demo, ImagePair, RigFolder
from pipeline.spec import Spec


class Shelf(Uploads):
    """With a clock that the test turns, and two browsers."""

    def __init__(self, root):
        self.now_s = 0.0
        self.here, self.there = object(), object()
        super().__init__(root, lambda: self.now_s)

    def rig(self, size_bytes=1):
        folder = self.new_folder(self.here)
        (folder / "rig").mkdir()
        (folder / "rig" / "a").write_bytes(bytes(size_bytes))
        source = RigFolder(str(folder / "rig"))
        self.keep(source, self.here)
        return source


@pytest.fixture
def shelf(tmp_path):
    return Shelf(tmp_path)


def test_an_upload_is_found_by_its_name_after_its_browser_has_gone_and_not_for_ever(shelf):
    source = shelf.rig()
    name = name_in(source)
    shelf.leave(shelf.here)
    assert shelf.find(name) == source
    shelf.keep(source, shelf.there)
    shelf.now_s = 2.0 * KEPT_S
    assert shelf.find(name) == source
    shelf.leave(shelf.there)
    shelf.now_s += 1.1 * KEPT_S
    assert shelf.find(name) is None
    assert list(shelf._root.iterdir()) == []


def test_what_was_never_opened_goes_with_its_browser(shelf):
    folder = shelf.new_folder(shelf.here)
    shelf.keep(Demo("office"), shelf.here)
    assert shelf.find(folder.name) is None
    shelf.leave(shelf.here)
    assert not folder.exists()


def test_the_one_left_longest_ago_makes_room(shelf, monkeypatch):
    monkeypatch.setattr(module, "LIMIT_BYTES", 150)
    first, second = shelf.rig(100), shelf.rig(100)
    assert shelf.find(name_in(first)) == first  # as long as somebody has it open
    shelf.leave(shelf.here)
    assert shelf.find(name_in(first)) is None
    assert shelf.find(name_in(second)) == second


@pytest.mark.parametrize(("limit_bytes", "stays"), [(199, False), (200, True)])
def test_one_byte_too_many_makes_room(shelf, monkeypatch, limit_bytes, stays):
    monkeypatch.setattr(module, "LIMIT_BYTES", limit_bytes)
    first, second = shelf.rig(100), shelf.rig(100)
    shelf.leave(shelf.here)
    assert (shelf.find(name_in(first)) == first) == stays
    assert shelf.find(name_in(second)) == second


def test_a_calibration_laid_over_an_upload_is_another_one_and_holds_it(shelf):
    rig, folder = shelf.rig(), shelf.new_folder(shelf.here) / "calibration_01"
    both = Calibrated(rig, str(folder))
    shelf.keep(both, shelf.there)
    shelf.leave(shelf.here)
    shelf.now_s = 2.0 * KEPT_S
    assert name_in(both) == folder.parent.name
    assert shelf.find(name_in(both)) == both
    assert shelf.find(name_in(rig)) == rig


def test_names_are_long_and_no_two_alike(shelf):
    names = {shelf.new_folder(shelf.here).name for _ in range(50)}
    assert len(names) == 50
    assert min(map(len, names)) > 20
    assert name_in(Demo("office")) is None


def test_a_command_names_files_as_their_owner_does(shelf):
    folder = shelf.new_folder(shelf.here) / OWN
    pair = ImagePair(*(str(folder / name) for name in ("my color.png", "depth/1.png", "k.json")))
    command = plain(Spec(pair).command())
    assert command.startswith(
        "packetmesh reconstruct --color 'my color.png' --depth depth/1.png --intrinsics k.json --preset"
    )
    assert plain(Spec(shelf.rig()).command()).startswith("packetmesh reconstruct --rig rig --preset")
    assert plain("packetmesh reconstruct --rig /tmp/upload-x/rig") == (
        "packetmesh reconstruct --rig /tmp/upload-x/rig"
    )


@pytest.mark.parametrize(
    ("name", "kept"),
    [
        ("Küche 1.PNG", "Küche 1.png"),
        ("../../etc/passwd", "passwd"),
        (r"C:\\a\\b.png", "b.png"),
        ("a;rm -rf $HOME`.png", "a-rm -rf -HOME-.png"),
        ("..", "file"),
        ("", "file"),
        ("x" * 300 + ".png", "x" * 76 + ".png"),
    ],
)
def test_a_file_keeps_its_name_without_what_a_path_or_a_shell_would_follow(tmp_path, name, kept):
    path = keep_upload(SimpleNamespace(name=name, content=b"1"), tmp_path / OWN, 10, "try less")
    assert path == tmp_path / OWN / kept
    assert path.read_bytes() == b"1"


def test_a_file_that_is_too_large_is_refused(tmp_path):
    with pytest.raises(InputError, match="try less"):
        keep_upload(SimpleNamespace(name="a.png", content=bytes(11)), tmp_path / OWN, 10, "try less")
    assert not (tmp_path / OWN).exists()

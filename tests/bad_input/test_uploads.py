"""Bad files through the app's own upload buttons: a sentence, and nothing outside the session's folder."""

import zipfile
from types import SimpleNamespace
from urllib.parse import urlencode

import pytest

from app.compute.state import Spec
from app.screens.calibrate.uploads import keep_photographs
from app.screens.scene.recording_job import recording_job
from app.session.address import Place, place_of
from packetmesh.errors import InputError, PacketMeshError
from packetmesh.progress import drain
from pipeline.io.demos import DEMO_SCENES
from pipeline.sources import Demo
from tests.bad_input.makers import png_of, zip_bomb, zipped
from tests.bad_input.samples import MM, RGB, data_of, opencv

K = b'{"width": 32, "height": 24, "fx": 28, "fy": 28, "cx": 15, "cy": 11}'
NAMES = (
    "../../out.png",
    "/tmp/out.png",
    "C:\\out.png",
    "..\\..\\out.png",
    "node_00/../../../out.png",
    "\\\\host\\out.png",
)


def rig(**files):
    return zipped({f"rig/node_00/{name.replace('__', '.')}": data for name, data in files.items()})


def tum(color):
    lists = {
        "rgb.txt": f"0.0 {color}\n".encode(),
        "depth.txt": b"0.0 depth.png\n",
        "depth.png": opencv(MM, ".png"),
    }
    return zipped(lists)


def link(place):
    """A symbolic link in a ZIP."""
    item = zipfile.ZipInfo("rig/node_00/color.png")
    item.external_attr = 0o120777 << 16
    return zipped({item: place.encode()})


GOOD = {"color__png": opencv(RGB, ".png"), "depth__png": opencv(MM, ".png"), "intrinsics__json": K}
RECORDINGS = {
    "a bomb": lambda: zip_bomb("rig/node_00/color.png", 3 << 30),
    "a bomb that lies": lambda: zip_bomb("rig/node_00/color.png", 3 << 30, 1000),
    "30,000 files": lambda: zipped({f"{k}": b"" for k in range(30_000)}),
    "a huge image": lambda: rig(**GOOD | {"color__png": png_of(30_000, 30_000, deep=False)}),
    "a deep JSON": lambda: rig(**GOOD | {"intrinsics__json": b'{"a":' * 10_000}),
    "pictures above it": lambda: tum("../secret.png"),
    "pictures anywhere": lambda: tum("/etc/hostname"),
    "a link to anywhere": lambda: link("/etc/passwd"),
    "cut": lambda: rig(**GOOD)[:-100],
    "encrypted": lambda: rig(**GOOD).replace(b"PK\1\2\x14\3\x14\0\0\0", b"PK\1\2\x14\3\x14\0\1\0"),
    **{f"names such as {name}": lambda name=name: zipped({name: b"x"}) for name in NAMES},
}


@pytest.fixture
def folder(tmp_path):
    """A session's folder, beside that of another."""
    (tmp_path / "secret.png").write_bytes(opencv(RGB, ".png"))
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "upload.zip").write_bytes(b"another's")
    (tmp_path / "session").mkdir()
    return tmp_path / "session"


def outside(folder):
    return {
        path: path.read_bytes()
        for path in folder.parent.rglob("*")
        if path.is_file() and folder not in path.parents
    }


@pytest.mark.parametrize("name", RECORDINGS)
def test_a_bad_recording_is_one_sentence_and_touches_nothing_else(name, folder):
    path, before = folder / "recording_000.zip", outside(folder)
    path.write_bytes(RECORDINGS[name]())
    with pytest.raises(PacketMeshError) as caught:
        drain(recording_job(None, None, path, "rig-000", None, 3))
    assert "\n" not in str(caught.value)
    assert [one.name for one in folder.iterdir()] == ["recording_000.zip"]
    assert outside(folder) == before


PHOTOGRAPHS = {
    "nothing": lambda: b"",
    "no more than a mark": lambda: b"PK\3\4",
    "a bomb": lambda: zip_bomb("a.png", 3 << 30),
    "a bomb that lies": lambda: zip_bomb("a.png", 3 << 30, 1000),
    "no picture": lambda: zipped({"a.txt": b"x"}),
}


@pytest.mark.parametrize("name", PHOTOGRAPHS)
def test_bad_photographs_are_one_sentence(folder, name):
    sent = SimpleNamespace(name="a.zip", content=PHOTOGRAPHS[name]())
    with pytest.raises(InputError) as caught:
        keep_photographs(sent, folder / "photographs", "node_00")
    assert "\n" not in str(caught.value)
    assert not list(folder.iterdir())


@pytest.mark.parametrize("name", NAMES)
def test_photographs_stay_in_their_folder_whatever_they_are_called(folder, name):
    before, picture = outside(folder), data_of("color.png")
    for sent, content in ((name, picture), ("a.zip", zipped({name: picture}))):
        keep_photographs(SimpleNamespace(name=sent, content=content), folder / "photographs", "node_00")
    assert {path.parent.name for path in folder.rglob("*.png")} == {"node_00"}
    assert outside(folder) == before


@pytest.mark.parametrize(
    "setting", ["depth.model=/etc/passwd", " depth.model=/etc/passwd", "depth.model =/x", "\tdepth.model=x"]
)
def test_an_address_opens_no_file(setting):
    start = Place(Spec(Demo("office")), "Scene")
    sources = {name: Demo(name) for name in DEMO_SCENES}
    place, wrong = place_of(urlencode({"set": setting}), start, ("Scene",), sources)
    assert place == start
    assert len(wrong) == 1
    assert "names a file" in wrong[0]

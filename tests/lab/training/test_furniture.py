import bz2
import io
import lzma
import tarfile
import zipfile
from dataclasses import replace

import cv2
import numpy as np
import pytest

from lab.training.furniture import Catalogue
from lab.training.models import load_model, make_model, save_model
from lab.training.wavefront import Finish, Wavefront
from packetmesh.errors import InputError

_BOX_FACES = "f 1/1 3/3 4/4 2/2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"


def _box_obj(low, high, finish):
    """A box in the catalogue's frame (Y up)."""
    corners = [
        f"v {x} {y} {z}" for z in (low[2], high[2]) for y in (low[1], high[1]) for x in (low[0], high[0])
    ]
    uvs = "vt 0 0\nvt 1 0\nvt 0 1\nvt 1 1\n"
    return "mtllib stuff.mtl\n" + "\n".join(corners) + f"\n{uvs}usemtl {finish}\n{_BOX_FACES}"


MTL = """newmtl red
Kd 1 0 0
newmtl shiny_metal
Kd 0 0 1
Ks 0.9 0.9 0.9
Ns 200
newmtl wear
map_Kd wear.png
"""
PROPERTIES = """# a comment
id=Tiny
name#1=Oak table
category#1=Living room
model#1=/tiny/table.obj
width#1=120
depth#1=60
height#1=72.5
doorOrWindow#1=false
name#2=Little lamp
category#2=Lights
model#2=/tiny/lamp.obj
width#2=20
depth#2=20
height#2=40
doorOrWindow#2=false
lightSourceX#2=10
lightSourceY#2=4
lightSourceZ#2=35
name#3=Chair
category#3=Living room
model#3=/tiny/lamp.obj
width#3=40
depth#3=50
height#3=90
doorOrWindow#3=false
modelRotation#3=0 0 1 0 1 0 -1 0 0
name#4=Wall clock
category#4=Living room
model#4=/tiny/table.obj
width#4=30
depth#4=5
height#4=30
elevation#4=160
doorOrWindow#4=false
name#5=Window
category#5=Doors and windows
model#5=/tiny/table.obj
width#5=100
depth#5=30
height#5=120
elevation#5=90
doorOrWindow#5=true
name#6=Sedan
category#6=Vehicles
model#6=/tiny/table.obj
width#6=180
depth#6=450
height#6=150
doorOrWindow#6=false
name#7=Wardrobe
category#7=Bedroom
model#7=/tiny/lamp.obj
width#7=90
depth#7=60
height#7=200
doorOrWindow#7=false
"""


def write_catalogue(file):
    """Two OBJ models, seven entries."""
    picture = np.zeros((64, 64, 3), np.uint8)
    picture[:32, :, 1] = 255  # green above, black below
    table = _box_obj((0, 0, 0), (1, 1, 1), "red")
    lamp = _box_obj((-3, 0, -2), (3, 7, 2), "shiny_metal")
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("PluginFurnitureCatalog.properties", PROPERTIES.encode("latin-1"))
        archive.writestr("PluginFurnitureCatalog_fr.properties", "name#1=Bureau\n")
        archive.writestr("tiny/table.obj", table)
        archive.writestr("tiny/lamp.obj", lamp)
        archive.writestr("tiny/stuff.mtl", MTL)
        archive.writestr("tiny/picture.obj", _box_obj((0, 0, 0), (2, 1, 0.1), "wear"))
        archive.writestr("tiny/wear.png", cv2.imencode(".png", picture)[1].tobytes())
    return file


def write_package(file, content, compress=lzma.compress):
    """A Debian package with one file in it."""
    tar = io.BytesIO()
    with tarfile.open(fileobj=tar, mode="w") as archive:
        member = tarfile.TarInfo("./usr/share/sweethome3d/furniture/Tiny.sh3f")
        member.size = len(content)
        archive.addfile(member, io.BytesIO(content))
    members = {
        "debian-binary": b"2.0\n",
        "control.tar.xz": b"abc",
        "data.tar": compress(tar.getvalue()),
    }
    with file.open("wb") as stream:
        stream.write(b"!<arch>\n")
        for name, data in members.items():
            stream.write(f"{name:<16}{0:<12}{0:<6}{0:<6}{'100644':<8}{len(data):<10}`\n".encode())
            stream.write(data + b"\n" * (len(data) % 2))
    return file


@pytest.fixture(scope="module")
def catalogue(tmp_path_factory):
    folder = tmp_path_factory.mktemp("furniture")
    write_catalogue(folder / "Tiny.sh3f")
    return Catalogue.open(folder, tmp_path_factory.mktemp("cache"))


def test_records_become_entries_with_true_sizes_and_places(catalogue):
    table, lamp, *_ = catalogue.entries
    assert [entry.role for entry in catalogue.entries] == [
        "table",
        "small",
        "chair",
        "wall",
        "opening",
        "unused",
        "against",
    ]
    assert table.name == "Oak table"
    np.testing.assert_allclose(table.size_m, [1.2, 0.6, 0.725])
    np.testing.assert_allclose(lamp.light_m, [0.0, 0.06, 0.35])
    assert catalogue.entries[3].elevation_m == pytest.approx(1.6)


def test_models_stand_on_the_floor_with_their_true_size(catalogue):
    for entry in catalogue.entries:
        places = np.concatenate([surface.vertices_m for surface in catalogue.model(entry).surfaces])
        low, high = [-0.5, -0.5, 0.0] * entry.size_m, [0.5, 0.5, 1.0] * entry.size_m
        np.testing.assert_allclose(places.min(axis=0), low, atol=1e-5)
        np.testing.assert_allclose(places.max(axis=0), high, atol=1e-5)


def test_materials_become_colours_and_kinds_of_surface(catalogue):
    table, lamp = (catalogue.model(entry) for entry in catalogue.entries[:2])
    assert [surface.kind for surface in table.surfaces] == ["matt"]
    assert {surface.kind for surface in lamp.surfaces} == {"glossy", "glowing"}
    place = np.array([[0.1, -0.2, 0.725]], np.float32)
    np.testing.assert_allclose(table.surfaces[0].colors(place, place), [[0.9, 0.01, 0.01]], atol=0.01)
    far = np.array([[9.0, 9.0, 9.0]], np.float32)
    np.testing.assert_allclose(table.surfaces[0].colors(far, far), [[0.9, 0.01, 0.01]], atol=0.01)
    np.testing.assert_allclose(table.top_m, 0.725, atol=1e-6)


def test_textures_keep_their_place_on_the_model(tmp_path):
    text = PROPERTIES.replace("/tiny/table.obj", "/tiny/picture.obj")
    file = write_catalogue(tmp_path / "Tiny.zip")
    changed = tmp_path / "Changed.zip"
    with zipfile.ZipFile(file) as source, zipfile.ZipFile(changed, "w") as target:
        for name in source.namelist():
            content = text.encode() if name == "PluginFurnitureCatalog.properties" else source.read(name)
            target.writestr(name, content)
    catalogue = Catalogue.open(changed, tmp_path / "cache")
    (surface,) = catalogue.model(catalogue.entries[0]).surfaces
    places = np.array([[0.2, 0.3, 0.6], [0.2, 0.3, 0.15]], np.float32)  # the back, where the image is
    green, black = surface.colors(places, places)
    assert green[1] > 0.8
    assert max(green[0], green[2], *black) < 0.02


def test_the_front_of_a_model_looks_along_minus_y_and_turns_with_the_catalogue():
    # One triangle at the front (+Z in the catalogue's frame) and one at the right (+X), both upright.
    vertices = np.array([[0, 0, 1], [0.1, 0, 1], [0, 1, 1], [1, 0, 0], [1, 0, 0.1], [1, 1, 0]], float)
    finishes = (Finish("a", np.array([1.0, 0.0, 0.0])), Finish("b", np.array([0.0, 1.0, 0.0])))
    mesh = Wavefront(vertices, np.arange(6).reshape(2, 3), np.zeros((2, 3, 2)), np.arange(2), finishes)
    quarter = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])  # +X to -Z, +Z to +X
    sizes = np.array([2.0, 2.0, 1.0])
    for turn, red_at, green_at in (
        (np.eye(3), (-1.0, -1.0), (1.0, 1.0)),
        (quarter, (1.0, -1.0), (-1.0, 1.0)),
    ):
        (surface,) = make_model(mesh, turn, sizes, None).surfaces
        places = np.array([[*red_at, 0.01], [*green_at, 0.01]], np.float32)
        red, green = surface.colors(places, places)
        assert red[0] > 0.8 > green[0]
        assert green[1] > 0.8 > red[1]


def test_cached_models_are_what_was_made(catalogue, tmp_path):
    model = catalogue.model(catalogue.entries[1])
    save_model(model, tmp_path / "model.npz")
    again = load_model(tmp_path / "model.npz")
    for before, after in zip(model.surfaces, again.surfaces, strict=True):
        assert before.kind == after.kind
        np.testing.assert_array_equal(before.vertices_m, after.vertices_m)
        np.testing.assert_array_equal(before.triangles, after.triangles)
        np.testing.assert_array_equal(before.colors.keys, after.colors.keys)
    np.testing.assert_array_equal(model.top_m, again.top_m)


def test_a_package_is_unpacked_once(tmp_path):
    content = write_catalogue(tmp_path / "Tiny.sh3f").read_bytes()
    package = write_package(tmp_path / "tiny_1.0_all.deb", content)
    names = [entry.name for entry in Catalogue.open(package, tmp_path / "cache").entries]
    (unpacked,) = (tmp_path / "cache").rglob("*.sh3f")
    written = unpacked.stat().st_mtime_ns
    assert [entry.name for entry in Catalogue.open(package, tmp_path / "cache").entries] == names
    assert len(names) == 7
    assert unpacked.stat().st_mtime_ns == written


def test_models_that_differ_in_rotation_or_light_only_are_cached_apart(catalogue):
    _, lamp, *_ = catalogue.entries
    turned = replace(lamp, rotation=np.diag([-1.0, 1.0, -1.0]))
    entries = lamp, turned, replace(lamp, light_m=None), replace(lamp, light_m=2.0 * lamp.light_m)
    assert len({entry.key for entry in entries}) == 4
    assert replace(lamp, name="Another name").key == lamp.key


@pytest.mark.parametrize("share", [0.9, 0.5, 0.05])
def test_a_package_that_was_cut_off_is_refused_in_one_sentence(tmp_path, share):
    content = write_catalogue(tmp_path / "Tiny.sh3f").read_bytes()
    package = write_package(tmp_path / "tiny.deb", content)
    package.write_bytes(package.read_bytes()[: int(share * package.stat().st_size)])
    with pytest.raises(InputError, match=r"tiny\.deb' .*download it again"):
        Catalogue.open(package, tmp_path / "cache")


def test_a_damaged_package_is_refused_in_one_sentence(tmp_path):
    noise = np.random.default_rng(4).bytes(300_000)
    package = write_package(tmp_path / "tiny.deb", noise, lambda data: bz2.compress(data, 1))
    data = bytearray(package.read_bytes())
    data[200_000:200_100] = bytes(100)
    package.write_bytes(data)
    with pytest.raises(InputError, match=r"tiny\.deb' is damaged .*download it again"):
        Catalogue.open(package, tmp_path / "cache")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("absent.deb", None, "There is no furniture"),
        ("text.deb", b"hello", "no Debian package"),
        ("broken.sh3f", b"hello", "no readable zip"),
        ("notes.txt", b"hello", "holds no .sh3f"),
    ],
)
def test_what_is_no_catalogue_is_refused(tmp_path, name, content, message):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=message):
        Catalogue.open(tmp_path / name, tmp_path / "cache")


def test_a_record_without_a_size_is_named(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("FurnitureCatalog.properties", "name#1=Box\nmodel#1=/a.obj\n")
    with pytest.raises(InputError, match="'width'"):
        Catalogue.open(tmp_path / "a.zip", tmp_path / "cache")

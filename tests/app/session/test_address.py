"""The address is the state: written and read back, and refused in a sentence."""

from dataclasses import replace

import pytest

from app.compute.state import Sent, Spec
from app.session.address import Place, name_of, place_of
from network_sim.config import NetworkConfig
from packetmesh.settings import with_settings
from pipeline.config import PRESETS
from pipeline.sources import Demo, Recorded, RigFolder, demo_of

SCREENS = ("Scene", "Fuse", "Surface")
SOURCES = {"office": Demo("office"), "desk-001": RigFolder("/tmp/x/desk-001")}
START = Place(Spec(Demo("office")), "Scene")


def read(text):
    place, wrong = place_of(text, START, SCREENS, SOURCES, ("stop", "t"))
    assert not wrong
    return place


@pytest.mark.parametrize("source", SOURCES.values())
@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("changes", [[], ["depth.reach=0.125", "surface.radii_m=0.03,0.07"]])
@pytest.mark.parametrize("added", [(), (("stop", "3"), ("t", "1.5 s, +"))])
def test_what_is_written_is_read_back(source, preset, changes, added):
    spec = Spec(source, preset, with_settings(PRESETS[preset], changes))
    place = Place(spec, "Surface", added)
    assert read(place.text()) == place
    assert name_of(source) in place.text()


def test_an_uploaded_recording_is_named_by_its_upload_and_a_demo_by_its_name():
    upload = "upload-" + 22 * "a"
    assert name_of(Recorded(f"/tmp/x/{upload}/my-walk", 5000.0)) == upload
    assert name_of(demo_of("living-room-walk")) == "living-room-walk"


def test_an_address_that_says_nothing_is_the_start():
    assert read("") == START
    assert read("unknown=1&") == START


def test_only_what_differs_is_in_it():
    assert START.text() == "scene=office&preset=packetmesh&screen=scene"
    sent = replace(START, spec=replace(START.spec, sent=Sent(NetworkConfig())))
    assert sent.text() == START.text()


def test_a_network_of_ones_own_is_not_in_it():
    spec = replace(START.spec, config=with_settings(START.spec.config, ["depth.model=/tmp/mine.onnx"]))
    assert "mine" not in Place(spec, "Fuse").text()


def test_back_goes_from_place_to_place_and_not_from_moment_to_moment():
    there = [
        START,
        replace(START, screen="Fuse"),
        replace(START, added=(("stop", "1"),)),
        replace(START, spec=replace(START.spec, source=Demo("living-room"))),
    ]
    assert [[one.is_apart(other) for other in there] for one in there] == [
        [one is not other for other in there] for one in there
    ]
    assert not replace(START, added=(("t", "5"),)).is_apart(START)
    assert not replace(START, spec=START.spec.with_preset("thesis")).is_apart(START)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("scene=attic", "scene=attic; try one of office, desk-001"),
        ("scene=/etc", "scene=/etc; try"),
        ("scene=upload-123", "no longer keeps"),
        ("preset=best", "preset=best; try one of packetmesh"),
        ("screen=kitchen", "try one of scene, fuse, surface"),
        ("set=depth.raech%3D0.1", "depth.reach"),
        ("set=depth.reach%3Dfar", "depth.reach"),
        ("set=depth.model%3D/etc/passwd", "names a file"),
        ("set=+depth.model+%3D/etc/passwd", "names a file"),
        ("set=depth.completion%3D/etc/passwd", "names a file"),
        ("set=nonsense", "nonsense"),
    ],
)
def test_what_cannot_be_followed_gets_a_sentence_and_the_rest_is_followed(text, says):
    place, wrong = place_of(f"{text}&set=depth.reach%3D0.125&stop=2", START, SCREENS, SOURCES, ("stop",))
    assert len(wrong) == 1
    assert says in wrong[0]
    config = with_settings(START.spec.config, ["depth.reach=0.125"])
    assert place == Place(replace(START.spec, config=config), START.screen, (("stop", "2"),))

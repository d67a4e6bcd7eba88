"""The address is the state: written and read back, and refused in a sentence."""

from dataclasses import replace

import pytest

from app.address import Place, name_of, place_of
from app.state import Sent, Spec
from network_sim.config import NetworkConfig
from packetmesh.errors import InputError
from packetmesh.settings import with_settings
from pipeline.config import PRESETS
from pipeline.sources import Demo, RigFolder

SCREENS = ("Scene", "Fuse", "Surface")
SOURCES = {"office": Demo("office"), "desk-001": RigFolder("/tmp/x/desk-001")}
START = Place(Spec(Demo("office")), "Scene")


def read(text):
    return place_of(text, START, SCREENS, SOURCES)


@pytest.mark.parametrize("source", SOURCES.values())
@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("changes", [[], ["depth.reach=0.125", "surface.radii_m=0.03,0.07"]])
@pytest.mark.parametrize("shown", ["after", "before"])
def test_what_is_written_is_read_back(source, preset, changes, shown):
    spec = Spec(source, preset, with_settings(PRESETS[preset], changes), shown)
    place = Place(spec, "Surface")
    assert read(place.text()) == place
    assert name_of(source) in place.text()


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


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("scene=attic", "scene=attic; try one of office, desk-001"),
        ("scene=/etc", "scene=/etc; try"),
        ("preset=best", "preset=best; try one of packetmesh"),
        ("screen=kitchen", "try one of scene, fuse, surface"),
        ("surface=none", "try one of after"),
        ("set=depth.raech%3D0.1", "depth.reach"),
        ("set=depth.reach%3Dfar", "depth.reach"),
        ("set=depth.model%3D/etc/passwd", "names a file"),
        ("set=nonsense", "nonsense"),
    ],
)
def test_what_cannot_be_followed_gets_a_sentence(text, says):
    with pytest.raises(InputError, match=says):
        read(text)

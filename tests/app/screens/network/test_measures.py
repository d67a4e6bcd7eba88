"""Measures on the surface that the sink has at the clock's time, in a room of small images."""

import numpy as np
import pytest

from app.compute.state import Spec
from app.measuring.address import tape_of
from app.screens.network import setup
from app.screens.network.panel import NetworkPanel
from lab.worlds.box_on_table import BOX_M, TABLE_M
from pipeline.io.rigs import save_rig
from pipeline.sources import RigFolder
from tests.app.fakes import Bench, Impatient, ui_of
from tests.pipeline.delivery.small import CONFIG, small_rig

EYE = np.array([1.6, 1.3, 1.9])
ON_BOX, ON_TABLE = (2.48, 2.53, TABLE_M[2] + BOX_M[2]), (2.2, 2.2, TABLE_M[2])
pytestmark = pytest.mark.xdist_group("network panel")


@pytest.fixture(scope="module")
def screen(store, server, tmp_path_factory):
    folder = tmp_path_factory.mktemp("rigs") / "small room"
    save_rig(folder, small_rig(nodes=3, scene="box-on-table"))
    spec = Spec(RigFolder(str(folder)), config=CONFIG)
    with pytest.MonkeyPatch.context() as few:
        few.setattr(setup, "MOMENTS", 2)
        ui = ui_of(server.scene, kind=Impatient)
        screen = Bench(NetworkPanel, ui, store, steps=("network",), spec=spec)
        screen.client.camera.position, screen.client.camera.look_at = EYE, np.array(ON_BOX)
        screen.panel.on_show()
        yield screen
        screen.ui.close()


def made(screen):
    folder = screen.panel._measures
    (taken,) = tape_of(folder.place()).taken
    return folder._made.get(taken)


def test_the_surface_that_arrived_is_measured_at_each_moment(screen):
    screen.gui.set("Clicks measure", True)
    screen.gui.set("What", "Point to plane")
    for point_m in (ON_BOX, ON_TABLE):
        screen.ui.scene.click(EYE, np.array(point_m) - EYE)
    (height,) = made(screen).quantities
    assert height.low < BOX_M[2] < height.high
    assert height.high - height.low < 0.06
    first, last = screen.results.view("network").moments
    screen.panel._dock.seek(first.t_ns + 1)
    assert made(screen).quantities != (height,)
    screen.panel._dock.seek(first.t_ns - 1)
    assert made(screen) is None
    assert "There is nothing to measure yet" in screen.gui.text("Measure")
    screen.panel._dock.seek(last.t_ns + 1)
    assert made(screen).quantities == (height,)

"""Measures on the points of a node, before any surface."""

import numpy as np
import pytest

from app.measuring.address import tape_of
from app.screens.scene.panel import ScenePanel
from lab.worlds.box_on_table import BOX_M, TABLE_M
from pipeline.io.demos import DEMOS
from pipeline.sources import demo_of
from tests.app.fakes import Bench, ui_of

EYE = np.array([1.6, 1.3, 1.9])
ON_BOX, ON_TABLE = (2.48, 2.53, TABLE_M[2] + BOX_M[2]), (2.3, 2.2, TABLE_M[2])


@pytest.fixture
def session(store, server):
    session = Bench(ScenePanel, ui_of(server.scene), store, steps=("scene",))
    session.client.camera.position, session.client.camera.look_at = EYE, np.array(ON_BOX)
    session.advance()
    return session


def test_a_measure_has_its_points_on_one_node_and_is_drawn_with_the_points(session):
    session.gui.set("Clicks measure", True)
    assert not {"Hole", "Box"} & set(session.gui.find("What").options)
    session.gui.set("What", "Point to plane")
    for point_m in (ON_BOX, ON_TABLE):
        session.ui.scene.click(EYE, np.array(point_m) - EYE)
    (taken,) = tape_of(session.panel.always_in_address["measure-points"].place()).taken
    (height,) = session.panel._measures._made[taken].quantities
    assert height.low < BOX_M[2] < height.high
    assert height.high - height.low < 0.05
    assert session.ui.scene.names("/scene/measures")


def test_another_scene_keeps_the_list_but_no_number(session):
    session.panel.always_in_address["measure-points"].take("distance~surface~2480_2530_890~2300_2200_740")
    assert len(session.ui.scene.names("/scene/measures")) > 1
    session.gui.set("Scene", DEMOS["office"].title)
    assert session.spec.source == demo_of("office")
    assert "not on this surface" in session.gui.text("Measure")
    assert session.ui.scene.names("/scene/measures") == []

"""Measures on the surface of a demo scene: clicks on the box of known size, exports and the report."""

import json
import zipfile
from io import BytesIO

import numpy as np
import pytest

from app.screens.export.job import export_job
from app.screens.surface.export_job import page_job
from app.screens.surface.labels import BEFORE, BOTH
from app.screens.surface.measure_job import measures_job
from app.screens.surface.panel import SurfacePanel
from app.screens.surface.settings import with_rule
from lab.worlds.box_on_table import BOX_M, TABLE_M
from packetmesh.progress import drain
from tests.app.fakes import Bench, ui_of

EYE = np.array([1.6, 1.3, 1.9])
ON_BOX, ON_TABLE = (2.48, 2.53, TABLE_M[2] + BOX_M[2]), (2.3, 2.2, TABLE_M[2])


@pytest.fixture(scope="module")
def session(store, server):
    session = Bench(SurfacePanel, ui_of(server.scene), store)
    session.client.camera.position, session.client.camera.look_at = EYE, np.array(ON_BOX)
    session.advance()
    session.gui.set("Clicks measure", True)
    return session


@pytest.fixture(autouse=True)
def anew(session):
    session.panel.always_in_address["measure"].take("")
    session.gui.set("Show", session.gui.find("Show").options[0])
    session.gui.set("What", "Plane to plane")


def click(session, *points_m):
    for point_m in points_m:
        session.ui.scene.click(EYE, np.array(point_m) - EYE)


def measures(session):
    return json.loads(drain(measures_job(session.store, session.spec)))["measures"]


def test_two_clicks_measure_the_height_of_the_box(session):
    click(session, ON_BOX, ON_TABLE)
    (measure,) = measures(session)
    (height,) = measure["values"]
    low, high = height["ci95"]
    assert low < BOX_M[2] < high
    assert high - low < 0.02
    assert (height["unit"], height["guessed"], measure["kind"]) == ("m", False, "plane-plane")
    assert session.drawn("/surface/after/measures") is not None
    assert "± " in session.gui.text("Measure")


def test_the_list_survives_another_radius_and_is_measured_anew(session):
    click(session, ON_BOX, ON_TABLE)
    place = session.panel.always_in_address["measure"].place()
    (before,) = measures(session)
    session.edit(with_rule("manual", 30.0))
    assert session.panel.always_in_address["measure"].place() == place
    (after,) = measures(session)
    assert after["values"][0]["value"] == pytest.approx(before["values"][0]["value"], abs=0.01)
    assert after["values"] != before["values"]


def test_clicks_go_to_the_surface_after_fusion_where_it_is_drawn(session):
    session.gui.set("Show", BEFORE)
    click(session, ON_BOX, ON_TABLE)
    assert "not shown" in session.gui.text("Measure")
    assert session.panel.always_in_address["measure"].place() == ""
    session.gui.set("Show", BOTH)
    offset_m = session.panel._stage.offset_m("after")
    assert np.linalg.norm(offset_m) > 1.0
    for point_m in (ON_BOX, ON_TABLE):
        session.ui.scene.click(EYE + offset_m, np.array(point_m) - EYE)
    assert measures(session)[0]["values"][0]["value"] == pytest.approx(BOX_M[2], abs=0.01)


def test_a_click_that_measures_explains_no_hole(session):
    folder = session.panel._holes
    hole = next(one for one in session.panel._view.holes["after"] if not one.rim)
    click(session, hole.center_m)
    assert folder._index is None
    session.gui.set("Clicks measure", False)
    click(session, hole.center_m)
    assert folder._index is not None
    session.gui.set("Clicks measure", True)


def test_measures_are_in_the_run_folder_its_report_and_the_page(session):
    assert [offers.kind for offers in session.panel.offers()] == ["To show"]
    click(session, ON_BOX, ON_TABLE)
    session.gui.set("Its name", "box & table")
    assert [offers.kind for offers in session.panel.offers()] == ["To show", "Measures"]
    content = drain(export_job(session.store, session.spec, "run.zip", "after"))
    with zipfile.ZipFile(BytesIO(content)) as archive:
        report = archive.read("run/report.html").decode()
        listed = json.loads(archive.read("run/measures.json"))
    assert listed["measures"] == measures(session)
    assert "Measured on the surface" in report
    assert "box &amp; table" in report
    page = drain(page_job(session.store, session.spec, "photo")).decode()
    assert "Measured, with 95 % intervals: box &amp; table" in page

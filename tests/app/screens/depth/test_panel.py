"""The whole Depth screen with real jobs and no browser: what is drawn, what settings do, and the lesson."""

from dataclasses import replace

import numpy as np
import pytest

from app.compute.cuts import Plane
from app.lesson.reading import read_lesson
from app.looking.look import Look, text_of
from app.screens.depth.brush import painted
from app.screens.depth.hide import BUTTON
from app.screens.depth.labels import COLORINGS, EVERYWHERE, FILLS, HOLES, PICTURES, UNSEEN
from app.screens.depth.lesson import KIND, SHIPPED
from app.screens.depth.model import SHIPPED as SHIPPED_NETWORK
from app.screens.depth.panel import DepthPanel
from app.screens.depth.view import Disc
from packetmesh.errors import InputError
from pipeline.depth.inference import SHIPPED_MODEL
from pipeline.sources import Demo
from tests.app.fakes import Bench, ui_of

pytestmark = pytest.mark.xdist_group("depth panel")
HIDE, MODEL = "Hide a region and see it filled", "Neural network"


@pytest.fixture(scope="module")
def session(store, server, tmp_path_factory):
    uploads = tmp_path_factory.mktemp("uploads")
    session = Bench(DepthPanel, ui_of(server.scene), store, uploads, steps=("scene", "depth"))
    session.advance()
    session.panel.on_show()
    return session


def node_of(session):
    return session.results.view("depth").nodes[0]


def drawn(session, name):
    """The (N, 6) points and colours of a cloud, from left to right; None if it is not drawn.

    Args:
        name: name of the cloud below ``/depth``.
    """
    scene = session.ui.scene
    parts = [scene.get_handle_by_name(part) for part in scene.names(f"/depth/{name}")]
    found = [
        np.column_stack([part.points, np.broadcast_to(part.colors, part.points.shape)]) for part in parts
    ]
    return by_place(np.concatenate(found)) if found else None


def of_node(session, name):
    """The same of the first node."""
    return drawn(session, f"{node_of(session).name}/{name}")


def by_place(rows):
    return rows[np.lexsort(rows.T[::-1])]


def test_the_screen_begins_with_photo_beside_sensor_and_the_filled_points(session):
    node = node_of(session)
    photo, sensor = node.pictures["photo"].rgb, node.pictures["sensor"].rgb
    (image,) = session.gui.all("image")
    np.testing.assert_array_equal(image.image[:, :300], photo[:, :300])
    np.testing.assert_array_equal(image.image[:, -300:], sensor[:, -300:])
    assert len(of_node(session, "inferred")) == len(node.filled.points_m)
    assert "z′ = (" in session.gui.text("Residuals of the alignment")
    (histogram,) = session.gui.all("plotly")
    assert histogram.figure.data[0].y.sum() == node.residuals.counts.sum()
    assert node.provider in session.gui.text()


def test_the_address_says_which_pictures_and_whose_are_shown_and_is_followed(session):
    parts, gui = session.panel.in_address, session.gui
    assert (parts["pictures"].place(), parts["node"].place()) == ("", "")
    gui.set("Right", PICTURES["difference"])
    gui.set("Split (%)", 25.0)
    said = parts["pictures"].place()
    assert said == "photo,difference,25"
    parts["pictures"].take("")
    assert [gui.find(name).value for name in ("Right", "Split (%)")] == [PICTURES["sensor"], 50.0]
    parts["pictures"].take(said)
    assert parts["pictures"].place() == said
    for wrong in ("photo", "photo,attic,20", "photo,sensor,120", "photo,sensor,nan"):
        with pytest.raises(InputError, match="such as photo,sensor,50"):
            parts["pictures"].take(wrong)
    assert parts["pictures"].place() == said
    parts["pictures"].take("")


def test_a_node_that_an_address_asks_for_is_shown_once_it_is_there(session):
    node, view = session.panel.in_address["node"], session.results.view("depth")
    node.take("node_07")
    assert node.place() == "node_07"
    seventh = replace(view, nodes=(*view.nodes, replace(view.nodes[0], name="node_07")))
    session.panel.on_view("depth", seventh)
    assert session.gui.find("Node").value == node.place() == "node_07"
    session.panel.on_view("depth", view)
    assert node.place() == ""
    node.take("node_99")
    with pytest.raises(InputError, match="node_99, which does not exist here; try one of node_00"):
        session.panel.on_view("depth", view)
    assert node.place() == ""


def test_inferred_points_are_drawn_where_and_as_wanted(session):
    gui, node = session.gui, node_of(session)
    gui.set("Inferred points", EVERYWHERE)
    gui.set("Colours", next(name for name, key in COLORINGS.items() if key == "confidence"))
    points = node.inferred.points_m.astype(np.float16)
    wanted = by_place(np.column_stack([points, node.inferred_confidence]).astype(float))
    np.testing.assert_array_equal(of_node(session, "inferred"), wanted)
    gui.set("Inferred points", UNSEEN)
    assert of_node(session, "inferred") is None
    gui.set("Inferred points", HOLES)
    gui.set("Colours", next(iter(COLORINGS)))
    assert len(of_node(session, "inferred")) == len(node.filled.points_m)


def test_clouds_that_come_while_another_screen_is_shown_are_drawn_with_the_next_visit(session):
    panel, view = session.panel, session.results.view("depth")
    panel.on_hide()
    before = of_node(session, "sensor")
    seen = view.nodes[0].sensor
    seen = replace(seen, points_m=seen.points_m[:5], colors=None, pixels=seen.pixels[:5])
    fewer = replace(view, nodes=(replace(view.nodes[0], sensor=seen), *view.nodes[1:]))
    session.results.put("depth", session.spec.key("depth"), fewer)
    panel.on_view("depth", fewer)
    np.testing.assert_array_equal(of_node(session, "sensor"), before)
    panel.on_show()
    assert len(of_node(session, "sensor")) == 5
    session.results.put("depth", session.spec.key("depth"), view)
    panel.on_view("depth", view)
    np.testing.assert_array_equal(of_node(session, "sensor"), before)


def test_a_bad_network_is_one_sentence_and_the_settings_stay(session):
    before = session.spec
    session.gui.upload("Add an ONNX file …", "bad.onnx", b"nonsense")
    assert session.spec == before
    assert "is not a readable ONNX network" in session.notices.pop()
    assert "previous network stays" in session.gui.text(MODEL)


def test_a_network_can_be_uploaded_and_given_back(session):
    session.gui.upload("Add an ONNX file …", "mine.onnx", SHIPPED_MODEL.read_bytes())
    assert session.spec.config.depth.model.startswith(str(session.folder))
    assert session.gui.find("Network file").value == "mine.onnx"
    session.gui.set("Network file", SHIPPED_NETWORK)
    assert session.spec.config.depth.model is None


def click(session, pixel_row):
    """A click on one drawn sensor point of the first node, from where its camera stands."""
    T = session.results.view("scene").nodes[0].T_world_camera
    session.ui.scene.click(T[:3, 3], T[:3, :3] @ node_of(session).sensor.points_m[pixel_row].astype(float))


def marked(session):
    """The painted points, or None."""
    return drawn(session, "painted")


def test_clicks_paint_what_is_hidden_and_filled(session):
    gui, seen = session.gui, node_of(session).sensor
    rows = [int(np.argmin(np.abs(seen.pixels - middle).sum(axis=1))) for middle in ((120, 150), (480, 120))]
    gui.set("Brush", True)
    gui.set("Diameter (%)", 12.0)
    for row in rows:
        click(session, row)
    assert "2 discs painted" in gui.text(HIDE)
    discs = [Disc(*(seen.pixels[row] / (639, 479)), 0.12) for row in rows]
    wanted, got_m = seen.points_m[painted(seen, discs)], marked(session)
    assert len(got_m) == pytest.approx(len(wanted), rel=0.2)  # a degree beside the point is 9 pixels
    assert len(got_m) > 100
    gui.set("Outliers", False)
    assert marked(session) is not None
    gui.press(BUTTON)
    assert "measured pixels of node_00 hidden" in gui.text(HIDE)
    session.drawn("/depth").visible = False
    click(session, rows[0])
    assert len(marked(session)) == len(got_m)
    session.drawn("/depth").visible = True
    gui.set("Node", "node_00")
    assert "painted" not in gui.text(HIDE)
    assert marked(session) is None


def test_what_was_filled_stays_when_another_step_gets_other_settings(session):
    session.gui.press("Discs", "Add")
    session.gui.press(BUTTON)
    filled = session.gui.text(HIDE)
    assert "measured pixels of node_00 hidden" in filled
    config, spec = session.spec.config, session.spec
    session.panel.on_spec(
        replace(spec, config=replace(config, surface=replace(config.surface, smoothing_passes=0)))
    )
    assert session.gui.text(HIDE) == filled
    session.panel.on_spec(spec)
    session.gui.press("Discs", "Clear")


def test_discs_of_another_scene_are_cleared_and_those_of_other_settings_stay(session):
    panel, spec = session.panel, session.spec
    session.gui.press("Discs", "Add")
    panel.on_spec(spec.with_preset("thesis"))
    assert "1 disc painted" in session.gui.text(HIDE)
    panel.on_spec(replace(spec, source=Demo("office")))
    assert "painted" not in session.gui.text(HIDE)
    panel.on_spec(spec)


def test_every_stop_of_the_lesson_sets_the_screen_as_it_says(session):
    gui = session.gui
    for stop in read_lesson(SHIPPED, KIND).stops:
        look = stop.look
        gui.press("Go", "Next")
        gui.press("Your guess", "Skip")
        config = session.spec.config.depth
        assert (config.alignment, config.reach, config.least_confidence) == (
            look.alignment,
            look.reach,
            look.least_confidence,
        )
        sides = [gui.find(side).value for side in ("Left", "Right")]
        assert sides == [PICTURES[look.left], PICTURES[look.right]]
        assert gui.find("Inferred points").value == look.drawn
        assert COLORINGS[gui.find("Colours").value] == look.coloring
        assert bool(gui.all("image", HIDE)) == (look.hide is not None)
    assert FILLS["ours"] in gui.text(HIDE)
    assert not session.notices
    session.edit(lambda config: replace(config, depth=replace(config.depth, alignment="median")))
    assert not gui.all("image", HIDE)
    assert FILLS["ours"] not in gui.text(HIDE)


def test_while_another_scene_has_come_and_its_depth_has_not_the_clouds_keep_their_places(session):
    results, node = session.results, node_of(session)
    scene, depth = results.view("scene"), results.view("depth")
    before = session.ui.scene.get_handle_by_name(f"/depth/{node.name}/sensor")
    place = before.wxyz.copy(), before.position.copy()
    moved = [replace(one, T_world_camera=np.eye(4), name="other") for one in scene.nodes[:1]]
    results.put("scene", session.spec.key("scene"), replace(scene, nodes=tuple(moved)))
    results.put("depth", "the scene before", depth)
    try:
        last = depth.nodes[-1].name
        session.gui.set("Node", last)  # the other scene has no such node
        session.gui.set("Colours", session.gui.find("Colours").options[-1])
        again = session.ui.scene.get_handle_by_name(f"/depth/{node.name}/sensor")
        np.testing.assert_array_equal(again.wxyz, place[0])
        np.testing.assert_array_equal(again.position, place[1])
        assert session.ui.scene.names(f"/depth/{last}/sensor")
    finally:
        results.put("scene", session.spec.key("scene"), scene)
        results.put("depth", session.spec.key("depth"), depth)
        session.gui.set("Node", node.name)


def test_the_brush_paints_only_what_a_cut_keeps(session, monkeypatch):
    painted_from = []
    monkeypatch.setattr(
        session.panel._hide, "clicked", lambda eye_m, way: painted_from.append(eye_m.tolist())
    )
    look = session.panel.in_address["look"]
    for point_m, normal in (((1.0, 0.0, 0.0), (1.0, 0.0, 0.0)), ((-1.0, 0.0, 0.0), (-1.0, 0.0, 0.0))):
        look.take(text_of(Look(Plane(point_m, normal))))
        session.panel._clicked(np.zeros(3), np.array([2.0, 0.0, 0.0]))
    look.take("")
    session.panel._clicked(np.zeros(3), np.array([2.0, 0.0, 0.0]))
    assert painted_from == [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]

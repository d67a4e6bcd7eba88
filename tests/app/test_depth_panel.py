"""The whole Depth screen with real jobs and no browser: what is drawn, what settings do, and the lesson."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import viser

from app import jobs
from app.screens.depth.brush import painted
from app.screens.depth.labels import COLORINGS, EVERYWHERE, HOLES, OURS, UNSEEN
from app.screens.depth.lesson import depth_lesson
from app.screens.depth.panel import DepthPanel
from app.screens.depth.view import ModelChoice
from app.state import Results, Spec
from packetmesh.errors import PacketMeshError
from packetmesh.progress import drain as end
from pipeline.depth.inference import SHIPPED_MODEL
from pipeline.sources import Demo

pytestmark = pytest.mark.xdist_group("depth panel")


class Session:
    """Computes at once and in this process what the panel asks for."""

    def __init__(self, server, store, folder):
        self.target, self.gui, self.scene = server, server.gui, server.scene
        self.store, self.folder = store, folder
        self.spec = Spec(Demo("box-on-table"))
        self.results, self.notices = Results(), []
        self.panel = DepthPanel(self)
        server.scene.add_frame("/depth", show_axes=False)
        self.panel.build()
        self.advance()

    def post(self, function, *arguments):
        function(*arguments)

    def edit(self, change):
        self.spec = replace(self.spec, config=change(self.spec.config))
        self.panel.on_spec(self.spec)
        self.advance()

    def advance(self):
        for step in ("scene", "depth"):
            if not self.results.fresh(step, self.spec):
                view = end(jobs.run(step, self.store, self.spec))
                self.results.put(step, self.spec.key(step), view)
                self.panel.on_view(step, view)

    def side_job(self, job, *arguments, on_end):
        try:
            view = end(jobs.run(job, *arguments))
        except PacketMeshError as error:
            self.notices.append(str(error))
            view = None
        on_end(view)

    quick_job = side_job


@pytest.fixture(scope="module")
def session(store, tmp_path_factory):
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield Session(server, store, tmp_path_factory.mktemp("uploads"))
    server.stop()


def drawn(session, name):
    """The points of the first node's cloud, or None."""
    node = session.results.view("depth").nodes[0]
    return session.scene.get_handle_by_name(f"/depth/{node.name}/{name}")


def test_the_screen_begins_with_photo_beside_sensor_and_the_filled_points(session):
    node = session.results.view("depth").nodes[0]
    photo, sensor = node.pictures["photo"].rgb, node.pictures["sensor depth"].rgb
    shown = session.panel._area._image.image
    np.testing.assert_array_equal(shown[:, :300], photo[:, :300])
    np.testing.assert_array_equal(shown[:, -300:], sensor[:, -300:])
    assert len(drawn(session, "inferred").points) == len(node.filled.points_m)
    assert "z′ = (" in session.panel._residuals.content
    assert session.panel._histogram.figure.data[0].y.sum() == node.residuals.counts.sum()
    assert node.provider in session.panel._numbers.content


def test_inferred_points_are_drawn_where_and_as_wanted(session):
    panel, node = session.panel, session.results.view("depth").nodes[0]
    panel._drawn.value = EVERYWHERE
    panel._coloring.value = next(name for name, key in COLORINGS.items() if key == "confidence")
    panel._draw()
    np.testing.assert_array_equal(drawn(session, "inferred").colors, node.inferred_confidence)
    panel._drawn.value = UNSEEN
    panel._draw()
    assert drawn(session, "inferred") is None
    panel._drawn.value, panel._coloring.value = HOLES, next(iter(COLORINGS))
    panel._draw()
    assert len(drawn(session, "inferred").points) == len(node.filled.points_m)


def test_a_bad_network_is_one_sentence_and_the_settings_stay(session, tmp_path):
    path = tmp_path / "bad.onnx"
    path.write_bytes(b"nonsense")
    before = session.spec
    session.panel._choose_model(ModelChoice(str(path)))
    assert session.spec == before
    assert "bad.onnx is not a readable ONNX network" in session.notices.pop()
    assert "before is kept" in session.panel._network._status.content


def test_the_network_that_ships_can_be_chosen_as_a_file(session):
    session.panel._choose_model(ModelChoice(str(SHIPPED_MODEL), "packetmesh"))
    assert session.spec.config.depth.model == str(SHIPPED_MODEL)
    assert session.panel._network._model.value == SHIPPED_MODEL.name
    session.panel._choose_model(ModelChoice())
    assert session.spec.config.depth.model is None


def click(session, pixel_row):
    """A click on one drawn sensor point of the first node, from where its camera stands."""
    T = session.results.view("scene").nodes[0].T_world_camera
    point_m = session.results.view("depth").nodes[0].sensor.points_m[pixel_row].astype(float)
    session.panel._clicked(SimpleNamespace(ray_origin=T[:3, 3], ray_direction=T[:3, :3] @ point_m))


def test_clicks_paint_what_is_hidden_and_filled(session):
    panel, seen = session.panel, session.results.view("depth").nodes[0].sensor
    rows = [int(np.argmin(np.abs(seen.pixels - middle).sum(axis=1))) for middle in ((120, 150), (480, 120))]
    panel._hide._brush.value, panel._hide._size.value = True, 12.0
    for row in rows:
        click(session, row)
    centres = np.array([(disc.x_share * 639, disc.y_share * 479) for disc in panel._hide.discs])
    np.testing.assert_allclose(centres, seen.pixels[rows], atol=6.0)  # a degree is 9 pixels
    marked = session.scene.get_handle_by_name("/depth/painted")
    assert len(marked.points) == painted(seen, panel._hide.discs).sum() > 100
    panel._draw()
    assert session.scene.get_handle_by_name("/depth/painted") is not None
    panel._hide._ask()
    assert "measured pixels of node_00 hidden" in panel._hide._status.content
    session.scene.get_handle_by_name("/depth").visible = False
    click(session, rows[0])
    assert len(panel._hide.discs) == 2
    session.scene.get_handle_by_name("/depth").visible = True
    panel._picked_node()
    assert panel._hide.discs == ()
    assert session.scene.get_handle_by_name("/depth/painted") is None


def test_discs_of_another_scene_are_cleared_and_those_of_other_settings_stay(session):
    panel, spec = session.panel, session.spec
    panel._hide._add()
    panel.on_spec(spec.with_preset("thesis"))
    assert len(panel._hide.discs) == 1
    panel.on_spec(replace(spec, source=Demo("office")))
    assert panel._hide.discs == ()
    panel.on_spec(spec)


def test_every_stop_of_the_lesson_sets_the_screen_as_it_says(session):
    panel = session.panel
    for stop in depth_lesson().stops:
        look = stop.look
        panel._take_look(look)
        config = session.spec.config.depth
        assert (config.alignment, config.reach, config.least_confidence) == (
            look.alignment,
            look.reach,
            look.least_confidence,
        )
        assert (panel._area._left.value, panel._area._right.value) == (look.left, look.right)
        assert panel._drawn.value == look.drawn
        assert COLORINGS[panel._coloring.value] == look.coloring
        assert panel._hide._area._image.visible == (look.hide is not None)
    assert OURS in panel._hide._table.content
    assert not session.notices
    session.edit(lambda config: replace(config, depth=replace(config.depth, alignment="median")))
    assert not panel._hide._area._image.visible
    assert panel._hide._table.content == ""

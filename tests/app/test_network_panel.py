"""The whole Network screen with real runs and no browser: what is drawn, what settings do, what fails."""

import contextlib
import shlex
from types import SimpleNamespace

import numpy as np
import pytest
import viser

from app import jobs
from app.screens.network.labels import NETWORKS
from app.screens.network.panel import CANCELLED, FAILED, ORIGIN, NetworkPanel
from app.screens.network.view import What
from app.state import Results, Spec
from network_sim.config import PRESETS
from packetmesh.errors import InputError, PacketMeshError
from packetmesh.progress import drain as end
from packetmesh.settings import with_settings
from pipeline.sources import Demo

pytestmark = pytest.mark.xdist_group("network panel")

FEW = "nodes.image_bytes=3000"


class Session:
    """Computes at once and in this process what the panel asks for."""

    def __init__(self, server, store):
        self.target, self.gui, self.scene = server, server.gui, server.scene
        self.store, self.notices, self.refuse = store, [], False
        self.spec, self.results = Spec(Demo("box-on-table")), Results()
        camera = SimpleNamespace(aspect=1.5, fov=0.9, position=None, look_at=None)
        self.client = SimpleNamespace(camera=camera, atomic=contextlib.nullcontext)
        self.panel = NetworkPanel(self)
        server.scene.add_frame("/network", show_axes=False)
        self.panel.build()
        self.panel._setup._text.value = FEW
        self.panel._setup._use_text()
        self.panel._resting.cancel()
        self.panel.on_show()

    def clients(self):
        return [self.client]

    def post(self, function, *arguments):
        function(*arguments)

    def frame_view(self):
        self.panel.look()

    def apart_job(self, job, *arguments, on_end):
        try:
            views = None if self.refuse else end(jobs.run(job, *arguments))
        except PacketMeshError as error:
            self.notices.append(str(error))
            views = None
        on_end(views)


@pytest.fixture(scope="module")
def session(store):
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    session = Session(server, store)
    yield session
    session.panel.close()
    server.stop()


def handle(session, name):
    return session.scene.get_handle_by_name(f"/network/runs/{session.panel._drawn}/{name}")


def shown(session):
    """Places of the packets and losses that are drawn now."""
    points = handle(session, "packets").points
    return points[points[:, 2] > -50.0]


def test_the_first_visit_simulates_and_shows_nodes_numbers_and_timeline(session):
    panel = session.panel
    (view,) = panel._views
    assert view.config.nodes.image_bytes == 3000
    assert len(handle(session, "0/node").points) == 3
    assert len(handle(session, "0/sink").points) == 1
    assert "simulated in" in panel._status.content
    assert "Image delivery ratio" in panel._table.content
    assert "<img" in panel._charts._rows[0].content
    assert session.client.camera.position[2] > 3.0
    np.testing.assert_array_equal(session.client.camera.look_at, np.zeros(3))


def test_nodes_and_ranges_are_drawn_to_one_scale(session):
    (view,) = session.panel._views
    scale = session.panel._drawing.ground.scale
    nodes, sink = handle(session, "0/node").points, handle(session, "0/sink").points[0]
    reach = np.linalg.norm(nodes[:, :2] - sink[:2], axis=1)
    np.testing.assert_allclose(reach, scale * view.config.nodes.spacing_m, rtol=1e-5)
    rim = handle(session, "0/range-sink").points.reshape(-1, 3)
    np.testing.assert_allclose(
        np.linalg.norm(rim[:, :2] - sink[:2], axis=1), scale * view.config.radio.range_m, rtol=1e-5
    )


def test_stepping_goes_from_event_to_event_and_packets_move(session):
    player, (view,) = session.panel._player, session.panel._views
    starts_ns = 1000 * np.unique(-(-view.pieces.start_ns // 1000))  # the player counts microseconds
    player.seek(view.start_ns)
    for expected_ns in starts_ns[starts_ns > view.start_ns][:20]:
        player._step(1)
        assert player.now_ns == expected_ns
    player._step(-1)
    assert player.now_ns == starts_ns[starts_ns > view.start_ns][18]
    frame = int(np.flatnonzero(view.pieces.what == 2)[5])
    player._speed.value = -3.0
    places = []
    for share in (0.25, 0.75):
        span_ns = view.pieces.end_ns[frame] - view.pieces.start_ns[frame]
        player.seek(int(view.pieces.start_ns[frame] + share * span_ns))
        assert 1 <= len(shown(session)) < 10
        places.append(shown(session))
    assert not np.array_equal(*places)
    assert "packetmesh-now" in session.panel._charts._rows[1].content


def test_the_window_zooms_about_the_player_and_turns_pages(session):
    charts, player, (view,) = session.panel._charts, session.panel._player, session.panel._views
    player.seek((view.start_ns + view.end_ns) // 2)
    charts._press("Frames")
    assert charts._window.span_ns < view.end_ns / 4
    frames_ns = view.pieces.start_ns[view.pieces.what == What.AIR]
    assert 0 <= player.now_ns - frames_ns[frames_ns <= player.now_ns].max() < 1000
    seen = (frames_ns >= charts._window.start_ns) & (frames_ns <= charts._window.end_ns)
    assert 20 <= seen.sum() <= 30
    before = charts._window
    player.seek(player.now_ns + before.span_ns)
    assert charts._window.start_ns > before.start_ns
    assert charts._window.span_ns == before.span_ns
    charts._press("All")
    assert (charts._window.start_ns, charts._window.end_ns) == (view.start_ns, view.end_ns)
    player.seek(view.end_ns)
    charts._press("Frames")
    assert charts._window.span_ns < view.end_ns / 3
    assert charts._window.end_ns == pytest.approx(view.end_ns, rel=0.1)


def test_a_second_run_gets_a_column_rows_and_a_place_beside(session):
    panel = session.panel
    panel._setup._beside.value = "a link of its own for each"
    panel._run()
    one, two = panel._views
    assert (one.config.mac.kind, two.config.mac.kind) == ("ieee802154", "ideal")
    assert f">{two.label}</th>" in panel._table.content
    assert all("<img" in panel._charts._rows[index].content for index in (0, 2))
    west, east = (handle(session, f"{index}/sink").points[0][0] for index in (0, 1))
    assert east - west > panel._drawing.ground.width
    lines = panel.command.splitlines()
    assert len(lines) == 2
    for line, view in zip(lines, panel._views, strict=True):
        words = shlex.split(line)
        assert words[:4] == ["packetmesh", "simulate", "--preset", "thesis-link"]
        assert with_settings(PRESETS[words[3]], words[5:]) == view.config
    panel._setup._beside.value = "nothing"
    panel._run()
    assert len(panel._views) == 1


def test_a_wrong_key_names_the_nearest_and_keeps_what_was(session):
    setup, before = session.panel._setup, session.panel._setup.runs()
    setup._text.value = "radio.shadow_db=3"
    with pytest.raises(InputError, match=r"try radio\.shadowing_db"):
        setup._use_text()
    assert setup.runs() == before
    setup._text.value = "run.horizon_s=0"
    with pytest.raises(InputError, match=r"run\.horizon_s"):
        setup._use_text()
    assert setup.runs() == before


def test_cancelled_and_failed_runs_are_sentences_and_retry_runs_again(session):
    panel = session.panel
    session.refuse = True
    panel._setup._seed.value = 7
    panel.on_action("Cancel")
    panel._run()
    assert panel._status.content == FAILED
    assert panel._views == ()
    panel._status.content = ""
    panel._cancelled = True
    panel._ended(panel._wanted, None)
    assert panel._status.content == CANCELLED
    session.refuse = False
    panel.on_action("Retry")
    assert panel._views[0].config.run.seed == 7


def test_vehicles_move_and_the_origin_of_the_schemes_is_told(session):
    panel = session.panel
    panel._setup._preset.value = NETWORKS["street-grid"].title
    panel._setup._load()
    panel._setup._count.value = 5
    panel._setup._extra = ("run.horizon_s=660",)
    panel._run()
    assert ORIGIN in panel._about.content
    assert panel._setup._way.label == "Scheme"
    (view,) = panel._views
    assert view.start_ns == 600_000_000_000
    start = handle(session, "0/vehicle").points.copy()
    panel._player.seek(view.start_ns + 10_000_000_000)
    moved = np.linalg.norm(handle(session, "0/vehicle").points - start, axis=1)
    assert moved.max() <= 1.001 * 100.0 * panel._drawing.ground.scale
    assert moved.min() > 0.0
    panel.on_action("Reset")
    assert panel._setup.preset == "thesis-link"

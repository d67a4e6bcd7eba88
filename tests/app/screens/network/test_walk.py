"""A recording on the Network screen: one node with one row, whose keyframes are drawn where it took them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import viser

from app.compute.state import Sent
from app.screens.network.delivery_draw import DeliveryDrawing
from app.screens.network.delivery_job import _first_view, _moment_view
from app.screens.network.delivery_numbers import more_rows, summary
from app.screens.network.packets import Frames
from app.screens.network.walk_draw import places_at, routes_m
from app.screens.network.what_if import WhatIf, places_of
from network_sim.metrics.arrivals import energy_by_node_j
from pipeline.delivery.moments import NOTHING, _moment
from pipeline.delivery.sending import received_at, send
from tests.app.fakes import ui_of
from tests.pipeline.delivery.small import READY_S, delivery_spec, small_rig, walked


@pytest.fixture(scope="module")
def sending():
    rig = walked(small_rig(nodes=3))
    return send(delivery_spec(rig, moments=3), rig)


@pytest.fixture(scope="module")
def view(sending):
    """The delivery with its moments, of which no surface is built."""
    view = _first_view(sending, Sent(sending.spec.network, "raw", 3), 0.1)
    times_ns = sending.times_ns.tolist()
    moments = [
        _moment_view(sending, _moment(sending, index, received_at(sending, t_ns), NOTHING), t_ns)
        for index, t_ns in enumerate(times_ns)
    ]
    return replace(view, moments=tuple(moments))


def test_the_timeline_has_one_row_for_the_camera(view):
    assert view.node_names == ("camera",)
    rows = [view.run.names[node] for node in view.run.lane_nodes]
    assert [name for name in rows if name != "sink"] == ["camera"]
    assert [node.ready_ns for node in view.nodes] == [round(1e9 * ready_s) for ready_s in READY_S]


def test_every_frame_is_of_the_keyframe_whose_bytes_it_carries(view):
    frames = Frames(view.run)
    rows = [
        view.image_row(frames.camera_of(item), int(frames.pieces.image[item]))
        for item in range(len(frames.pieces))
        if frames.carries_image(item)
    ]
    assert rows == sorted(rows)
    assert set(rows) == {0, 1, 2}
    assert view.image_row(0, -1) is None


def test_all_keyframes_have_the_energy_of_their_one_node(sending, view):
    for moment in view.moments:
        (used_j,) = energy_by_node_j(sending.trace, [moment.t_ns])[:, 0]
        assert [node.energy_j for node in moment.nodes] == [used_j] * 3
        assert moment.energy_j == pytest.approx(used_j)


def test_the_texts_speak_of_one_node_and_say_when_each_image_was_taken(view):
    assert "One node sent" in summary(view)
    assert "one radio sends 3 of its 3 keyframes" in summary(view).lower()
    rows = more_rows(view, view.moments[-1])
    assert all(f"{node.name}, taken at " in rows for node in view.nodes)


def test_frames_start_where_the_camera_took_its_last_keyframe(view):
    cameras_m = np.array([node.T_world_camera[:3, 3] for node in view.nodes])
    places_m = np.zeros((len(view.run.names), 3))
    for t_s, row in ((0.0, 0), (0.3, 0), (0.5, 1), (3.9, 1), (4.0, 2), (9.0, 2)):
        now_m = places_at(view, places_m, round(1e9 * t_s))
        np.testing.assert_array_equal(now_m[0], cameras_m[row])
        np.testing.assert_array_equal(now_m[1:], places_m[1:])
    assert not places_m.any()
    lines_m = routes_m(view, np.ones((3, 3)), np.array([[0, 1], [1, 0], [1, 2]]))
    np.testing.assert_array_equal(lines_m[:3, 0], cameras_m)
    assert len(lines_m) == 4
    assert not len(routes_m(view, np.ones((3, 3)), np.zeros((0, 2), int)))


def test_the_drawing_has_one_ball_which_moves_with_the_camera(view):
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        drawing = DeliveryDrawing(server.scene, "/run", view)
        drawing.show_moment(view.moments[-1], 1.0)
        (ball,) = drawing._batteries
        for node in view.nodes:
            drawing.show(node.ready_ns, 1)
            np.testing.assert_allclose(ball.position, node.T_world_camera[:3, 3])
        texts = [label.text for label in drawing._names]
    finally:
        server.stop()
    assert all("J" not in text and text.endswith("100 %") for text in texts)


def test_the_camera_can_get_a_wall_but_not_be_switched_off_or_dragged(view):
    places_m = places_of(view)
    assert tuple(places_m) == ("camera", "sink")
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        what_if = WhatIf(ui_of(server.scene), "/what-if", lambda: None)
        what_if.load(view, lambda name: np.append(places_m[name], 1.0))
        handles = SimpleNamespace(off=what_if._off, walled=what_if._walled, mover=what_if._mover)
        assert tuple(handles.off.options) == tuple(handles.mover.options) == ("none",)
        assert tuple(handles.walled.options) == ("none", "camera")
        assert what_if.walks
        what_if.leave_room()
        assert not what_if.walks
    finally:
        server.stop()

"""``pm.show``: what the page's recording draws, and when it moves."""

import base64
import json
import re
import threading

import msgspec
import numpy as np
import pytest
import zstandard

import packetmesh as pm
from app.drawing.colors import SOURCE, TARGET
from app.drawing.poses import wxyz_of

CUBE = pm.PointCloud(np.random.default_rng(0).uniform(-0.5, 0.5, (800, 3)))
DONE = pm.RegistrationResult(np.eye(4), (), True, "converged")
TURN = np.array([[0.0, -1.0, 0.0, 0.2], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


class Recorded:
    """The recording in a page: messages with their times, and arrays."""

    def __init__(self, page):
        data = base64.b64decode(re.search(r'__VISER_EMBED_DATA__="([^"]+)"', page)[1])
        inner = zstandard.ZstdDecompressor().decompress(data[8:], int.from_bytes(data[:8], "little"))
        length = int.from_bytes(inner[:8], "little")
        head = msgspec.msgpack.decode(inner[8 : 8 + length])
        self.duration_s = head["durationSeconds"]
        self.messages = head["messages"]

    def of(self, kind, name=None):
        return [
            (time_s, message)
            for time_s, message in self.messages
            if message["type"] == kind and name in (None, message.get("name"))
        ]


def recorded(view):
    return Recorded(view.page)


@pytest.fixture(scope="module")
def floor():
    x, y = np.meshgrid(np.arange(5.0), np.arange(5.0))
    xyz_m = np.stack([x, y, 0.0 * x], axis=-1).reshape(-1, 3)
    return pm.PointCloud(xyz_m, normals=np.tile([0.0, 0.0, 1.0], (25, 1)))


def test_the_page_needs_no_server_and_none_is_left():
    before = {thread.name for thread in threading.enumerate()}
    page = pm.show(CUBE).page
    assert {thread.name for thread in threading.enumerate()} <= before
    assert "__VISER_EMBED_DATA__" in page
    assert len(recorded(pm.show(CUBE)).of("PointCloudMessage", "/cloud")) == 1


def test_nothing_is_printed(capfd):
    pm.show(CUBE)
    assert capfd.readouterr() == ("", "")


def test_a_notebook_gets_the_page_in_a_frame():
    view = pm.show(CUBE)
    html = view._repr_html_()
    assert html.startswith("<iframe srcdoc=")
    assert html.count('"') == 6
    assert 'title="Cloud of 800 points"' in html
    assert "<script" not in html
    assert "page" not in repr(view)


def test_a_registration_plays_every_step_from_its_start():
    start = TURN.copy()
    start[0, 3] += 0.05
    result = pm.register(CUBE, CUBE.transformed(TURN), pm.RegistrationConfig("icp", "point"), start)
    played = recorded(pm.show(result, CUBE, CUBE.transformed(TURN), start))
    moves = played.of("SetPositionMessage", "/source")
    later = [(time_s, message["position"]) for time_s, message in moves if time_s > 0.0]
    moving = result.steps[:-1]  # the last step does not move it, which is not sent
    np.testing.assert_allclose(moving[-1].T_target_source, result.T_target_source, atol=1e-12)
    assert len(later) == len(moving) > 2
    for (_, position), step in zip(later, moving, strict=True):
        np.testing.assert_allclose(position, step.T_target_source[:3, 3], atol=1e-6)
    times_s = [time_s for time_s, _ in later]
    assert times_s == sorted(times_s)
    assert times_s[0] >= 1.0
    assert played.duration_s >= times_s[-1] + 1.0
    np.testing.assert_allclose(moves[-len(later) - 1][1]["position"], start[:3, 3], atol=1e-6)
    turned = played.of("SetOrientationMessage", "/source")[-1][1]["wxyz"]
    assert abs(np.dot(turned, wxyz_of(result.T_target_source))) == pytest.approx(1.0, abs=1e-6)


def test_a_long_registration_is_played_in_seconds():
    steps = pm.register(CUBE, CUBE.transformed(TURN), pm.RegistrationConfig("icp", "point"), TURN).steps
    long = pm.RegistrationResult(TURN, steps[:1] * 300, False, "max_iterations")
    assert recorded(pm.show(long, CUBE, CUBE)).duration_s < 10.0


def test_source_and_target_have_their_colours():
    played = recorded(pm.show(DONE, CUBE, CUBE))
    text = json.dumps(played.messages, default=repr)
    assert "/source" in text
    assert "/target" in text
    assert SOURCE != TARGET


def test_surfaces_rigs_and_reconstructions_are_drawn(floor):
    surface = recorded(pm.show(pm.roll_ball(floor, [1.0])))
    assert len(surface.of("GlbMessage", "/surface")) == 1
    rig = pm.Rig("one node", pm.load_demo("office").frames[:1])
    drawn = recorded(pm.show(rig))
    assert len(drawn.of("CameraFrustumMessage")) == 1
    assert len(drawn.of("PointCloudMessage")) == 1
    result = pm.reconstruct(rig, pm.with_settings(pm.PRESETS["packetmesh"], ["surface.max_points=3000"]))
    view = pm.show(result)
    assert view.title == "Reconstruction of one node"
    assert len(recorded(view).of("GlbMessage")) == len(recorded(view).of("CameraFrustumMessage")) == 1


def test_points_of_a_node_are_where_its_camera_saw_them():
    rig = pm.Rig("one node", pm.load_demo("office").frames[:1])
    drawn = recorded(pm.show(rig))
    position = drawn.of("SetPositionMessage", "/points/0")[-1][1]["position"]
    np.testing.assert_allclose(position, rig.frames[0].T_world_camera[:3, 3], atol=1e-6)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (({},), "instead of dict"),
        ((pm.PointCloud(np.empty((0, 3))),), "no points"),
        ((pm.Surface(np.empty((0, 3)), np.empty((0, 3), np.int32)),), "no triangles"),
        ((CUBE, CUBE), "alone"),
        ((DONE,), r"pm\.show\(result, source, target"),
        ((DONE, CUBE, CUBE, np.eye(3)), "T_init"),
        (
            (DONE, CUBE, CUBE.select(np.arange(0))),
            "points",
        ),
    ],
)
def test_what_cannot_be_shown_is_one_sentence_and_leaves_no_server(arguments, sentence):
    before = {thread.name for thread in threading.enumerate()}
    with pytest.raises(pm.InputError, match=sentence):
        pm.show(*arguments)
    assert {thread.name for thread in threading.enumerate()} <= before

"""Handles of cuts in a scene: where they stand, and what dragging them means."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from app.compute.cuts import Box, Plane, Top, kept, planes_of
from app.looking.handles import CutHandles, facing, turned, with_face
from app.looking.room import Room

ROOM = Room(np.array([0.0, 0.0, 0.0]), np.array([4.0, 3.0, 2.5]), 2.4, True)
BOX = Box((2.0, 1.5, 1.0), (2.0, 1.0, 0.8), 30.0)
NAMES = itertools.count()


@pytest.fixture
def handles(server):
    dragged, posted = [], []
    made = CutHandles(
        server.scene,
        f"/h{next(NAMES)}/look",
        lambda *call: posted.append(call),
        lambda *drag: dragged.append(drag),
    )
    made.dragged, made.posted = dragged, posted
    yield made
    made.draw(None, None)


def drag(server, handles, name, phase="end", **pose):
    """Move a handle as a hand does, and let the session hear of it."""
    grab(server, name, phase, **pose)
    run(handles.posted)


def run(posted):
    """Run what was posted to the session's thread."""
    while posted:
        function, *arguments = posted.pop(0)
        function(*arguments)


def grab(server, name, phase, **pose):
    """Move a handle as a hand does; the session has not heard of it."""
    grip = server.scene.get_handle_by_name(name)
    for key, value in pose.items():
        setattr(grip, key, value)
    for callback in grip._impl_aux.update_cb:
        callback(SimpleNamespace(phase=phase, target=grip))


def world(server, name):
    """(3, 3) rotation and (3,) place of a handle."""
    frame, grip = (server.scene.get_handle_by_name(one) for one in (name.rpartition("/")[0], name))
    R = turned(frame.wxyz)
    return R @ turned(grip.wxyz), R @ np.asarray(grip.position) + np.asarray(frame.position)


@pytest.mark.parametrize("cut", [Top(1.8), Plane((1.0, 1.0, 1.0), (0.6, 0.0, 0.8)), BOX])
def test_handles_stand_on_the_planes_and_know_their_normals(server, handles, cut):
    handles.draw(cut, ROOM)
    planes = planes_of(cut)
    assert len(handles.planes) == len(planes)
    for (name, axis), (point_m, normal) in zip(handles.planes, planes, strict=True):
        R, at_m = world(server, name)
        assert R @ axis == pytest.approx(normal, abs=1e-6)
        assert (at_m - point_m) @ normal == pytest.approx(0.0, abs=1e-6)


def test_no_room_no_cut_and_another_kind_remove_them(server, handles):
    handles.draw(BOX, None)
    assert handles.planes == []
    handles.draw(BOX, ROOM)
    names = [name for name, _ in handles.planes]
    handles.draw(Top(1.0), ROOM)
    assert len(handles.planes) == 1
    assert all(server.scene.get_handle_by_name(name) is None for name in names[1:])
    handles.draw(None, ROOM)
    assert server.scene.get_handle_by_name(names[0]) is None


def test_they_come_again_after_the_screen_has_cleared_its_drawing(server, handles):
    handles.draw(BOX, ROOM)
    server.scene.remove_by_name(handles.planes[0][0].rpartition("/")[0])
    handles.draw(BOX, ROOM)
    assert all(server.scene.get_handle_by_name(name) is not None for name, _ in handles.planes)


def test_dragging_a_height_or_a_plane_moves_the_cut(server, handles):
    handles.draw(Top(1.8), ROOM)
    drag(server, handles, handles.planes[0][0], "update", position=(2.0, 1.5, 1.2))
    assert handles.dragged[-1] == (Top(1.2), False)
    handles.draw(Plane((1.0, 1.0, 1.0), (0.0, 1.0, 0.0)), ROOM)
    half = np.sqrt(0.5)
    drag(server, handles, handles.planes[0][0], position=(1.0, 0.5, 1.0), wxyz=(half, 0.0, half, 0.0))
    cut, ended = handles.dragged[-1]
    assert ended
    assert cut.point_m == (1.0, 0.5, 1.0)
    assert cut.normal == pytest.approx((1.0, 0.0, 0.0), abs=1e-6)  # z turned about y by 90 degrees


def test_a_drag_that_the_session_hears_of_when_its_handle_is_gone_is_dropped(server, handles):
    handles.draw(BOX, ROOM)
    for cut in (Plane((1.0, 1.0, 1.0), (0.0, 1.0, 0.0)), None):
        name, _ = handles.planes[-1]
        grab(server, name, "update", position=(0.0, 0.0, 3.0))
        handles.draw(cut, ROOM)
        run(handles.posted)
    assert handles.dragged == []


@pytest.mark.parametrize("row", range(6))
def test_dragging_a_face_of_a_box_moves_that_face_only(server, handles, row):
    handles.draw(BOX, ROOM)
    name, _ = handles.planes[row]
    grip = server.scene.get_handle_by_name(name)
    moved = np.array(grip.position)
    moved[row // 2] += 0.1
    for phase in ("update", "end"):  # the frame stays while the face is dragged
        drag(server, handles, name, phase, position=tuple(moved))
        cut, _ = handles.dragged[-1]
        for face, ((old_m, normal), (new_m, _)) in enumerate(
            zip(planes_of(BOX), planes_of(cut), strict=True)
        ):
            out_m = 0.1 if row % 2 else -0.1
            assert (new_m - old_m) @ -normal == pytest.approx(out_m if face == row else 0.0, abs=1e-6)
        handles.follow(cut)
    handles.draw(cut, ROOM)
    for (grip_name, _), (point_m, _) in zip(handles.planes, planes_of(cut), strict=True):
        assert world(server, grip_name)[1] == pytest.approx(point_m, abs=1e-5)


def test_a_face_does_not_pass_the_opposite_one():
    flat = with_face(BOX, 5, -3.0)
    assert 0.0 < flat.size_m[2] < 0.02
    assert kept(flat, np.array([[*BOX.centre_m[:2], 0.605]])).all()  # at the lower face, which stays


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0.6, 0.0, -0.8)])
def test_a_plane_faces_its_normal_in_a_right_handed_frame(normal):
    R = facing(np.array(normal, float))
    assert R[:, 2] == pytest.approx(normal)
    assert pytest.approx(np.eye(3), abs=1e-9) == R.T @ R
    assert np.linalg.det(R) == pytest.approx(1.0)

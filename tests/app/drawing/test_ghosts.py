"""Ghost cameras in the scene: where they stand, whose points are shown, and what a hand does to them."""

from types import SimpleNamespace

import numpy as np
import pytest

from app.drawing.colors import GHOST, GHOST_DARK
from app.drawing.ghosts import LEAST_CHANCE, Ghosts
from pipeline.kernels.geometry import rigid, rotation_exp

TARGETS_M = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [2.0, 0.0, 1.0]], np.float32)
POSES = [rigid(np.eye(3), np.array([0.0, 1.0, 2.0])), rigid(rotation_exp(np.ones(3)), np.ones(3))]


@pytest.fixture
def drawn(server):
    moves, picks = [], []
    server.scene.add_frame("/plan", show_axes=False)
    ghosts = Ghosts(server.scene, "/plan", lambda *given: moves.append(given), picks.append)
    ghosts.draw(POSES, 0.8, 1.5, TARGETS_M, np.array([False, False, True]))
    return SimpleNamespace(ghosts=ghosts, node=server.scene.get_handle_by_name, moves=moves, picks=picks)


def test_each_ghost_has_a_pink_frustum_at_its_pose_and_one_has_the_handle(drawn):
    for row, pose in enumerate(POSES, 1):
        frustum = drawn.node(f"/plan/{row}")
        assert np.allclose(frustum.position, pose[:3, 3])
        assert tuple(frustum.color) == GHOST
        assert (frustum.fov, frustum.aspect) == (0.8, 1.5)
    assert drawn.node("/plan/handle-1") is not None
    drawn.ghosts.choose(1)
    assert drawn.node("/plan/handle-1") is None
    assert np.allclose(drawn.node("/plan/handle-2").position, POSES[1][:3, 3])


def test_a_dragged_handle_reports_ghost_pose_and_release(drawn):
    drawn.ghosts.choose(1)
    handle = drawn.node("/plan/handle-2")
    handle.position = (3.0, 2.0, 1.0)
    for phase in ("update", "end"):
        for heard in handle._impl_aux.update_cb:
            heard(SimpleNamespace(phase=phase))
    assert [(row, ended) for row, _, ended in drawn.moves] == [(1, False), (1, True)]
    pose = drawn.moves[0][1]
    assert np.allclose(pose, rigid(POSES[1][:3, :3], np.array([3.0, 2.0, 1.0])), atol=1e-6)


def test_only_points_that_are_likely_seen_are_shown_the_chosen_ghosts_in_full_colour(drawn):
    newly = [np.array([0.9, 0.2, 0.5 * LEAST_CHANCE]), np.array([0.1, 0.7, 0.0])]
    drawn.ghosts.show_newly(newly)
    cloud = drawn.node("/plan/seen")
    assert np.allclose(cloud.points[:2], TARGETS_M[:2])
    assert cloud.points[2, 2] < -100.0
    assert tuple(cloud.colors[0]) == GHOST
    assert tuple(cloud.colors[1]) != GHOST
    drawn.ghosts.choose(1)
    drawn.ghosts.show_newly(newly)
    assert tuple(drawn.node("/plan/seen").colors[1]) == GHOST
    drawn.ghosts.clear()
    assert drawn.node("/plan/seen") is None
    assert drawn.node("/plan") is not None


def test_points_on_dark_surface_have_their_own_colour(drawn):
    drawn.ghosts.show_newly([np.ones(3), np.zeros(3)])
    colors = [tuple(color) for color in drawn.node("/plan/seen").colors]
    assert colors == [GHOST, GHOST, GHOST_DARK]


def test_handle_and_frustum_grow_with_the_room_between_two_limits(drawn):
    sizes = []
    for diagonal_m in (0.1, 5.0, 100.0):
        corners_m = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, diagonal_m]], np.float32)
        drawn.ghosts.draw(POSES, 0.8, 1.5, corners_m, np.zeros(2, bool))
        sizes.append(drawn.node("/plan/handle-1").scale)
        assert np.ravel(drawn.node("/plan/1").scale)[0] == pytest.approx(0.7 * sizes[-1])
    assert sizes == pytest.approx([0.3, 0.6, 0.9])

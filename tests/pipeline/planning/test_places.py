"""Places for cameras in a room whose surfaces are known."""

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.planning import places
from pipeline.planning.places import candidates, floor_m, is_free
from pipeline.planning.space import FreeSpace
from tests.pipeline.planning.rooms import at, box_room, place, sheet, targets_at

TABLE = sheet((1, 1, 0.75), (1, 0, 0), (0, 0.8, 0), 0.1)
TARGETS = targets_at([(x, 2.9, 1.0) for x in (0.5, 1, 1.5, 2, 2.5, 3, 3.5)], (0, -1, 0))


@pytest.fixture(scope="module")
def room():
    return place([*box_room(), TABLE], TARGETS, cameras=[at((2, 0.5, 1.5), (2, 2, 1))])


def eyes_of(seen, kind, **limits):
    found = candidates(seen, [kind], **limits)
    assert {one.where for one in found} == {kind}
    return np.array([one.T_world_camera[:3, 3] for one in found])


def test_the_floor_is_the_lowest_level_part(room):
    assert floor_m(room) == pytest.approx(0.0, abs=1e-6)
    high = place([(points_m + np.array([0, 0, 3.2]), faces) for points_m, faces in box_room()], TARGETS)
    assert floor_m(high) == pytest.approx(3.2, abs=1e-6)


def test_on_walls_a_camera_is_just_off_one_at_the_height_of_a_lamp(room):
    eyes_m = eyes_of(room, "walls")
    to_wall_m = np.min([eyes_m[:, 0], 4 - eyes_m[:, 0], eyes_m[:, 1], 3 - eyes_m[:, 1]], axis=0)
    assert np.allclose(to_wall_m, places.OFF_WALL_M, atol=1e-6)
    low_m, high_m = places.WALL_HEIGHTS_M
    assert eyes_m[:, 2].min() >= low_m
    assert eyes_m[:, 2].max() <= min(high_m, 2.5)


def test_from_the_ceiling_it_hangs(room):
    assert np.allclose(eyes_of(room, "ceiling")[:, 2], 2.5 - places.OFF_WALL_M, atol=1e-6)


def test_on_furniture_it_stands_on_the_table(room):
    eyes_m = eyes_of(room, "furniture")
    assert np.allclose(eyes_m[:, 2], 0.75 + places.OFF_WALL_M, atol=1e-6)
    assert np.all((eyes_m[:, :2] > (1, 1)) & (eyes_m[:, :2] < (2, 1.8)))


def test_a_tripod_keeps_away_from_every_surface(room):
    eyes_m = eyes_of(room, "tripods")
    inside_m = np.min([eyes_m, (4, 3, 2.5) - eyes_m], axis=(0, 2))
    assert inside_m.min() >= places.CLEAR_M - 1e-6


def test_every_camera_is_upright_and_looks_at_one_of_the_aims(room):
    aims_m = places.aims(room)
    assert len(aims_m) == places.AIMS
    for one in candidates(room, ["walls", "tripods"]):
        T = one.T_world_camera
        assert abs(T[2, 0]) < 1e-9  # its rows are level,
        assert T[2, 1] < 0.0  # and its image is not upside down
        away_m = np.linalg.norm(np.cross(aims_m - T[:3, 3], T[:3, 2]), axis=1)
        assert away_m.min() < 1e-6


def test_of_many_an_even_selection_is_left_and_it_is_the_same_again(room):
    found = candidates(room, places.WHERES, most=40)
    assert len(found) == 40
    assert {one.where for one in found} == set(places.WHERES)
    for one, again in zip(found, candidates(room, places.WHERES, most=40), strict=True):
        assert np.array_equal(one.T_world_camera, again.T_world_camera)


def test_space_that_no_camera_saw_is_not_free(room):
    place_m = np.array([[2.0, 1.5, 1.5]])
    assert is_free(room, place_m, 0.3).all()
    assert not is_free(room, np.array([[9.0, 1.5, 1.5]]), 0.3).any()
    space = FreeSpace(room.space.low_m, np.zeros_like(room.space.free))
    dark = type(room)(**{name: getattr(room, name) for name in room.__slots__} | {"space": space})
    assert not is_free(dark, place_m, 0.3).any()
    with pytest.raises(InputError, match="no free place for a camera on tripods"):
        candidates(dark, ["tripods"])


def test_a_place_that_is_not_there_is_one_sentence():
    bare = place([sheet((0, 0, 0), (4, 0, 0), (0, 3, 0), 0.2)], TARGETS)
    for kind in ("walls", "ceiling", "furniture"):
        with pytest.raises(InputError, match=f"no free place for a camera on {kind}; allow another"):
            candidates(bare, [kind])
    with pytest.raises(InputError, match="No camera may stand anywhere"):
        candidates(bare, [])

"""Keyframes' clouds in less memory."""

import numpy as np
import pytest

from pipeline.recording.clouds import KEPT, KeyframeClouds
from pipeline.registration.organised import organised
from tests.pipeline.recording.rendered import CAMERA, around, in_the_living_room


def test_clouds_are_what_was_added_rounded_to_float32_whether_used_lately_or_not():
    room = in_the_living_room(around(3), noise_m=0.002)
    added = [organised(room.view(k % 3).depth, CAMERA) for k in range(3)]
    clouds = KeyframeClouds()
    for k in range(KEPT + 3):
        clouds.add(2 * k, added[k % 3])
    assert list(clouds) == list(range(0, 2 * KEPT + 6, 2))
    assert len(clouds) == KEPT + 3
    first = clouds[4]
    assert clouds[4] is first
    assert [len(clouds[2 * k]) for k in range(KEPT + 3)] == [len(added[k % 3]) for k in range(KEPT + 3)]
    assert clouds[4] is not first
    for got, expected in ((first, added[2]), (clouds[2], added[1])):
        np.testing.assert_array_equal(got.rows, expected.rows)
        np.testing.assert_allclose(got.points_m, expected.points_m, rtol=1e-6)
        np.testing.assert_allclose(got.normals, expected.normals, atol=1e-6)
        np.testing.assert_allclose(got.z_m, expected.z_m, rtol=1e-6)
        assert got.points_m.dtype == np.float64
    np.testing.assert_array_equal(clouds[4].points_m, first.points_m)


def test_a_number_that_is_no_keyframe_is_none():
    clouds = KeyframeClouds()
    assert clouds == {}
    assert 3 not in clouds
    with pytest.raises(KeyError):
        clouds[3]

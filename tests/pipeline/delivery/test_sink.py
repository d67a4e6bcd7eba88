"""A frame at the sink is exactly what arrived of it."""

from dataclasses import replace

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.delivery.coding import Received
from pipeline.delivery.sink import frame_at_sink, heard, images_of, units_per_m
from pipeline.io.demos import load_demo
from pipeline.types import DepthMap


@pytest.fixture(scope="module")
def frame():
    return load_demo("office").frames[0]


def received(frame, color=1.0, depth=1.0):
    images, rng = images_of(frame), np.random.default_rng(3)
    shape = images.depth.shape
    known, measured = rng.random(shape) < color, rng.random(shape) < depth
    return Received(
        np.where(known[..., None], images.rgb, 0).astype(np.uint8),
        known,
        np.where(measured, images.depth, 0).astype(np.uint16),
        np.zeros(shape, np.uint16),
    )


def test_everything_that_arrived_is_the_frame_itself(frame):
    there = frame_at_sink(frame, received(frame))
    assert np.array_equal(there.rgb, frame.rgb)
    assert np.array_equal(there.depth.z_m, frame.depth.z_m, equal_nan=True)
    assert there.rgb_known is None
    assert there.coarse is None


@pytest.mark.parametrize("units", [1000.0, 5000.0, 256.0])
def test_depth_in_any_usual_unit_survives_to_the_bit(frame, units):
    counts = np.array([[0, 1, 700], [1234, 9999, 65535]], np.uint16)
    z_m = (counts / units).astype(np.float32)
    z_m[counts == 0] = np.nan
    counted = replace(frame, depth=DepthMap(z_m), rgb=np.zeros((2, 3, 3), np.uint8))
    assert units_per_m(counted.depth) == units
    assert np.array_equal(images_of(counted).depth, counts)


def test_lost_depth_is_a_hole_and_lost_colour_is_remembered_as_lost(frame):
    part = received(frame, color=0.5, depth=0.5)
    there = frame_at_sink(frame, part)
    assert np.array_equal(there.depth.valid, part.depth > 0)
    assert there.rgb_known is not None
    assert np.array_equal(there.rgb_known, part.rgb_known)
    assert np.array_equal(there.rgb[part.rgb_known], frame.rgb[part.rgb_known])


def test_a_node_is_heard_once_a_fiftieth_of_its_depth_is_there(frame):
    assert not heard(frame_at_sink(frame, received(frame, depth=0.0)))
    assert heard(frame_at_sink(frame, received(frame, depth=0.1)))


def test_depth_beyond_sixteen_bits_is_refused(frame):
    far = replace(frame, depth=DepthMap(np.full((480, 640), 70.0001, np.float32)))
    with pytest.raises(InputError, match=r"65\.5 m"):
        images_of(far)

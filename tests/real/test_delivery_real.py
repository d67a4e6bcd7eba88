"""The codings on two real Kinect frames: what SPEC 6.5 says of their sizes and what bursts leave."""

import cv2
import numpy as np
import pytest

from pipeline.delivery import CODINGS
from pipeline.delivery.coding import Images
from tests.pipeline.delivery.losses import bursts
from tests.pipeline.delivery.pictures import received


@pytest.fixture(params=["kinect_basket", "kinect_desk"])
def images(request, shared_data) -> Images:
    folder = shared_data / request.param
    if not folder.is_dir():
        pytest.skip(f"no {request.param} in {shared_data}")
    bgr = cv2.imread(str(folder / "color.png"), cv2.IMREAD_COLOR)
    depth = cv2.imread(str(folder / "depth.png"), cv2.IMREAD_UNCHANGED)
    return Images(np.ascontiguousarray(bgr[..., ::-1]), depth)


def test_rvl_takes_a_quarter_of_a_real_depth_image_and_loses_nothing(images):
    stream = CODINGS["jpeg"].encode(images, 108)
    depth_bytes = int.from_bytes(stream[:4], "big")
    assert depth_bytes / images.depth.nbytes == pytest.approx(0.25, abs=0.03)
    result = received(CODINGS["rvl"], images, 108, lambda count: np.ones(count, bool))
    np.testing.assert_array_equal(result.depth, images.depth)
    np.testing.assert_array_equal(result.rgb, images.rgb)


@pytest.mark.parametrize("packet_bytes", [108, 1464])
def test_layers_hold_a_real_frame_through_bursts(images, packet_bytes):
    coding = CODINGS["layered"]
    data = coding.encode(images, packet_bytes)
    assert len(data) <= 1.3 * len(CODINGS["jpeg"].encode(images, packet_bytes))
    rng = np.random.default_rng(2)
    result = received(coding, images, packet_bytes, lambda count: ~bursts(count, 0.1, rng), data)
    measured = images.depth > 0
    assert ((result.depth > 0) | (result.coarse > 0))[measured].mean() > 0.99
    assert result.rgb_known.all()
    arrived = result.depth > 0
    np.testing.assert_array_equal(result.depth[arrived], images.depth[arrived])

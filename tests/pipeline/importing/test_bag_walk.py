"""A walk through a rendered room, recorded as a bag: its path is found."""

import numpy as np
import pytest

from packetmesh.progress import drain
from pipeline.importing.recorded import open_recording
from pipeline.kernels.geometry import inverse
from pipeline.recording.walk import iterate_walk
from tests.pipeline.importing.bag_parts import Images, Info
from tests.pipeline.importing.bags import BagWriter, link
from tests.pipeline.recording.rendered import CAMERA, around, errors, in_the_living_room

POSES = around(60)[:12]


@pytest.mark.parametrize("with_poses", [True, False], ids=["moving transforms", "no poses"])
def test_the_path_of_a_bag_is_found(tmp_path, with_poses):
    rendered = in_the_living_room(POSES)
    bag = BagWriter(tmp_path / "walk.bag", "ros1")
    with bag.writer:
        bag.write("/rgb/camera_info", Info(k=CAMERA.matrix, frame="optical").message(bag, 50.0), 50.0)
        for k, T in enumerate(POSES):
            time_s, frame = 50.0 + k / 30.0, rendered.frame(k)
            depth_mm = np.rint(1000.0 * np.nan_to_num(frame.depth.z_m)).astype(np.uint16)
            bag.write("/rgb/image", Images(frame.rgb[None], "optical").message(bag, time_s, 0), time_s)
            bag.write("/depth/image", Images(depth_mm[None], "optical").message(bag, time_s, 0), time_s)
            moved = link(bag, "map", "optical", T)
            moved.header = bag.header("map", time_s)
            if with_poses:
                bag.write("/tf", bag.make("tf2_msgs/msg/TFMessage", [moved]), time_s)
    rig = drain(iterate_walk(open_recording(tmp_path / "walk.bag")))
    found = rig.walk.T_world_camera
    shifts_m, turns_deg = errors([inverse(found[0]) @ T for T in found], POSES)
    assert np.max(shifts_m) < 0.005
    assert np.max(turns_deg) < 0.2
    assert any("The poses are those by the transforms" in note for note in rig.walk.notes) == with_poses
    assert not any("contradict" in note for note in rig.walk.notes)
    if with_poses:
        np.testing.assert_allclose(found[0], POSES[0], atol=0.01)

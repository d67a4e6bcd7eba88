"""What a delivery keeps from one moment to the next."""

from dataclasses import replace

import pytest

from packetmesh.settings import with_settings
from pipeline.delivery.memory import places_by_depth
from tests.pipeline.delivery.small import CONFIG, small_rig


@pytest.mark.parametrize(
    ("changes", "known", "by_depth"),
    [
        ([], (True, True), True),
        ([], (True, False), False),
        (["fusion.align_nodes_with=fused"], (True, True), False),
        (["node_registration.start=global"], (True, True), False),
        (["node_registration.method=hicp"], (True, True), False),
        (["node_registration.method=icp"], (True, True), True),
    ],
)
def test_poses_depend_on_depth_alone_only_if_nothing_looks_at_colours(changes, known, by_depth):
    rig = small_rig()
    frames = (replace(frame, pose_known=one) for frame, one in zip(rig.frames, known, strict=True))
    assert places_by_depth(with_settings(CONFIG, changes), replace(rig, frames=tuple(frames))) == by_depth

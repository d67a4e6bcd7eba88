"""Keyframes that are looked for by colours and surfaces, some of which show nothing there."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from pipeline.recording.places import Places
from pipeline.types import DepthMap, RgbdFrame
from tests.pipeline.recording.rendered import Rendered, around, living_room


@dataclass(frozen=True)
class DepthAside(Rendered):
    """Frames whose depth camera looks past the picture of the colour camera in the second one."""

    def frame(self, index: int) -> RgbdFrame:
        frame = super().frame(index)
        z_m = frame.depth.z_m
        return replace(frame, depth=DepthMap(np.full_like(z_m, np.nan))) if index == 1 else frame


@pytest.mark.parametrize("way", ["colour", "surfaces"])
def test_a_keyframe_without_depth_on_its_colours_is_found_nowhere(way):
    recording = DepthAside(*living_room(), around(36)[:2])
    assert recording.view(1).depth.valid.any()
    assert Places(recording).pose(1, 0, way) is None

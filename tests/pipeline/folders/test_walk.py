"""Numbers of a recording's path."""

import numpy as np
import pytest

from pipeline.folders.walk import walk_metrics
from pipeline.types import PointCloud, Walk


@pytest.mark.parametrize(("resumed_s", "frames_per_s"), [(0.0, 20.0), (30.0, 5.0)])
def test_the_time_of_interrupted_runs_counts_for_the_frames_a_second(resumed_s, frames_per_s):
    poses = (np.eye(4),) * 200
    nothing = PointCloud(np.zeros((0, 3))), 0.01, np.zeros(0, int)
    walk = Walk(np.arange(200) / 30.0, poses, (0,), (), *nothing, poses, (), resumed_s)
    assert walk_metrics(walk, 10.0)["frames_per_s"] == frames_per_s

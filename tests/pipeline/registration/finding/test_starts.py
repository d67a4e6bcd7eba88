"""Features that agree, and random samples where no camera is known: first without a viewpoint, else last."""

import numpy as np
import pytest

from packetmesh.errors import ReconstructionError
from pipeline.kernels.geometry import rigid
from pipeline.registration.finding import starts
from pipeline.registration.finding.starts import by_surfaces
from tests.pipeline.registration.finding.places import pair, scan

AGREED, SAMPLED = rigid(np.eye(3), [1.0, 0.0, 0.0]), rigid(np.eye(3), [2.0, 0.0, 0.0])
VIEWS = scan((1.0, 1.2, 1.3), 0), scan((2.0, 1.5, 1.1), 1)


@pytest.fixture
def ways(monkeypatch):
    """What the two ways find; nothing is an error."""
    found = {"agreed": [AGREED], "sampled": [SAMPLED]}

    def way(name):
        def poses(*_):
            if not found[name]:
                raise ReconstructionError(f"none {name}")
            return iter(found[name])

        return poses

    monkeypatch.setattr(starts, "global_starts", way("agreed"))
    monkeypatch.setattr(starts, "sampled_starts", way("sampled"))
    return found


def poses(clouds, from_cameras=False) -> list[float]:
    return [float(T[0, 3]) for T in by_surfaces(*clouds, from_cameras).poses()]


def test_views_of_cameras_are_found_by_agreement_at_both_sizes(ways):
    assert poses(VIEWS, from_cameras=True) == [1.0, 1.0]


def test_clouds_that_look_like_views_are_sampled_last(ways):
    assert poses(VIEWS) == [1.0, 1.0, 2.0]
    ways["agreed"] = []
    assert poses(VIEWS) == [2.0]


@pytest.mark.parametrize("clouds", [pair(), (VIEWS[0], pair()[1])])
def test_without_a_viewpoint_samples_come_first(ways, clouds):
    assert poses(clouds) == [2.0, 1.0, 1.0]
    ways["sampled"] = []
    assert poses(clouds) == [1.0, 1.0]


@pytest.mark.parametrize("clouds", [pair(), VIEWS])
def test_without_any_pose_there_is_a_reason(ways, clouds):
    ways["agreed"] = ways["sampled"] = []
    with pytest.raises(ReconstructionError, match="none"):
        poses(clouds)

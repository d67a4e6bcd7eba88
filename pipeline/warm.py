"""``python -m pipeline.warm``: compile what is compiled, so that its first use is not a wait."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pipeline.config import RegistrationConfig
from pipeline.registration import register
from pipeline.surface.pivoting import compile_all
from pipeline.surface.smooth import smooth
from pipeline.surface.voxel import voxel_average
from pipeline.types import PointCloud


def warm_up() -> Iterator[None]:
    """Roll a ball, thin, smooth and register, each once, with yields; what is compiled stays on disk."""
    compile_all()
    yield
    grid_m = np.stack(np.meshgrid(np.arange(8.0), np.arange(8.0), [0.0, 1.0]), axis=-1).reshape(-1, 3)
    black = np.zeros(grid_m.shape, np.uint8)
    cloud = PointCloud(grid_m, colors=black, normals=np.tile([0.0, 0.0, 1.0], (len(grid_m), 1)))
    smooth(voxel_average(cloud, 0.5), 1)
    yield
    for direction in ("q2p", "p2q"):
        register(cloud, PointCloud(grid_m + 0.1), RegistrationConfig(direction=direction, gate_m=1.0))
        yield


if __name__ == "__main__":
    for _ in warm_up():
        pass

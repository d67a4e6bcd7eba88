"""The job of the measuring tool on the points of the nodes."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np

from app.compute.measures import MeasureAnswer, MeasureRequest
from app.compute.records import SCREEN_POINTS, drawn_rows
from app.compute.state import Spec
from app.compute.store import Store
from app.measuring.work import answer
from packetmesh.progress import Progress
from pipeline.acquisition import back_project
from pipeline.measuring.surface import MeasuredSurface, measured_cloud
from pipeline.spec import key
from pipeline.surface.normals import estimate_normals
from pipeline.types import Rig

FEWEST = 4
"""Least number of points of a cloud that can be measured."""


def measure_job(
    store: Store, spec: Spec, request: MeasureRequest
) -> Generator[Progress, None, MeasureAnswer]:
    """Turn clicks into points of the nodes' clouds, and compute measures.

    All points of a measure are on one node, because the poses between the nodes are not registered yet.
    """

    def make() -> Generator[Progress, None, list[MeasuredSurface]]:
        return _clouds((yield from store.stage(spec, "rig")))

    clouds = yield from store.remember(("measured-points", key(spec, "rig")), make)
    return answer(clouds, request)


def _clouds(rig: Rig) -> list[MeasuredSurface]:
    """Return some points of every node with normals, world frame; nodes with too few points are left out."""
    clouds = []
    for frame in rig.frames:
        cloud = back_project(frame)
        cloud = cloud.select(drawn_rows(len(cloud), SCREEN_POINTS // len(rig.frames)))
        if len(cloud) >= FEWEST:
            cloud = estimate_normals(cloud, np.zeros(3))
            clouds.append(measured_cloud(cloud.transformed(frame.T_world_camera)))
    return clouds

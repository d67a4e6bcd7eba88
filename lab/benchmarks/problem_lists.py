"""``python -m lab.benchmarks.problem_lists FOLDER``: lists of problems of our rooms and of a LiDAR pair.

The rooms are box rooms that no claim uses, seen by two cameras. The LiDAR pair is from the source archive of
small_gicp (``data/source.ply``, ``target.ply``, ``T_target_source.txt``), an independent recording. Each
source, aligned with its target, is rotated by up to 45 degrees and shifted by up to a fifth of its size. The
rotation is about the place where its middle was before it was aligned, so that its middle moves farther.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from lab.benchmarks.problems import write_problems
from lab.claims.registration.cases import CONDITIONS, make_case, random_subset
from pipeline.io.clouds import read_cloud
from pipeline.io.poses import read_pose
from pipeline.kernels.geometry import rigid, rotation_exp
from pipeline.kernels.point_sets import middle_extent_m
from pipeline.pairs.register import Pair
from pipeline.types import FloatArray, PointCloud

ROOMS = range(300, 305)
CONDITION = "nodes-sensor"
ROOM_POINTS = 20_000
TURN_DEG, SHIFT_OF_EXTENT = 45.0, 0.2
"""Largest rotation, and largest shift as a share of the cloud's extent."""


def motions(cloud: PointCloud, count: int, seed: int) -> list[FloatArray]:
    """Return (4, 4) motions about a cloud's middle, with angles and shifts uniform from 0 to the largest.

    ``main`` takes the cloud in its own frame, and the lists apply the motions in the target's frame.
    """
    rng = np.random.default_rng(seed)
    center_m, extent_m = cloud.points_m.mean(axis=0), middle_extent_m(cloud.points_m)
    result = []
    for _ in range(count):
        axis, way = (vector / np.linalg.norm(vector) for vector in rng.normal(size=(2, 3)))
        rotation = rotation_exp(np.radians(rng.uniform(0.0, TURN_DEG)) * axis)
        shift_m = rng.uniform(0.0, SHIFT_OF_EXTENT) * extent_m * way
        result.append(rigid(rotation, center_m - rotation @ center_m + shift_m))
    return result


def main() -> None:
    """Write the lists."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--lidar", type=Path, help="the folder `data` of small_gicp's source archive")
    parser.add_argument("--motions", type=int, default=10, help="of each pair")
    options = parser.parse_args()
    cases = [make_case(CONDITIONS[CONDITION], room) for room in ROOMS]
    pairs = [
        Pair(
            random_subset(case.source, ROOM_POINTS, 1),
            random_subset(case.target, ROOM_POINTS, 2),
            np.eye(4),
            case.T_true,
        )
        for case in cases
    ]
    turns = [motions(case.source, options.motions, room) for case, room in zip(cases, ROOMS, strict=True)]
    write_problems(options.folder, "box-rooms", pairs, turns, [case.overlap for case in cases])
    if options.lidar is not None:
        source, target = (read_cloud(options.lidar / f"{role}.ply") for role in ("source", "target"))
        pair = Pair(source, target, np.eye(4), read_pose(options.lidar / "T_target_source.txt"))
        write_problems(options.folder, "lidar", [pair], [motions(source, options.motions, 0)], [float("nan")])


if __name__ == "__main__":
    main()

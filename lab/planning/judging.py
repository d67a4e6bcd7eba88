"""Suggested cameras in one room: the promised and the real gain of each."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from lab.between_cameras.rigs import room_rig, room_scene
from lab.planning.kept import frame_at, outcome
from lab.worlds.render import Renderer
from lab.worlds.scene import Scene
from packetmesh.errors import PacketMeshError
from packetmesh.progress import drain
from pipeline.kernels.geometry import scaled
from pipeline.kernels.rays import Camera, first_hits, triangle_scene
from pipeline.planning.plan import Candidates, iterate_candidates
from pipeline.planning.promise import promise
from pipeline.planning.seen import SeenPlace, seen_place
from pipeline.planning.sensors import AS_PRESENT, sensor_named
from pipeline.planning.views import pixels_of
from pipeline.reconstruct import reconstruct
from pipeline.types import FloatArray, IntArray, RigTruth

SUGGESTIONS = 10
SEARCH_SCALE = 0.25
"""Size of the images of the exhaustive search, as a share of the sensor's."""
NEAR_SHARE = 0.03
"""A target counts as measured in the search if the new depth there is within this share of the true depth."""

Row = dict[str, str | float | bool]


@dataclass(frozen=True, slots=True)
class Suggested:
    """One suggested camera."""

    room: int
    rank: int
    """Place among the room's suggestions by the promise; 0 is what the planner would choose."""
    where: str
    promised: float
    """Promised gain, like all gains here in points (%) of the present cameras' rays."""
    low: float
    high: float
    """Ends of the promise's interval."""
    real: float
    """Gain after the camera was rendered and added to the rig; 0 if it sees too little."""
    placed: bool
    overlap_share: float
    searched: float
    """Gain of this camera by the exhaustive search, which renders the depth of every allowed candidate."""
    best_searched: float
    """Largest gain that the exhaustive search finds for a candidate of the room."""


def judged_room(seed: int) -> list[Row]:
    """Return the room's suggestions: the best candidate, and others evenly down the ranks, rendered."""
    rig, scene = room_rig(seed), room_scene(seed)
    assert rig.truth is not None
    renderer = Renderer(scene, threads=1)
    base = reconstruct(rig)
    seen = seen_place(base)
    judged = drain(iterate_candidates(seen, sensor_named(AS_PRESENT, rig)))
    rows = ranked(judged)
    picks = rows[np.linspace(0, len(rows) - 1, SUGGESTIONS).astype(int)]
    searched = 100.0 * _searched(seen, judged, scene, renderer, rig.truth, seed)
    suggested = []
    for rank, row in enumerate(picks):
        found = promise(judged.chance[row], seen.targets)
        pose = judged.candidates[row].T_world_camera
        try:
            came = outcome(scene, renderer, base, pose, seed)
            real, placed = came.gain_share, came.placed
        except PacketMeshError:  # the new camera sees too little
            real, placed = 0.0, False
        low, high = found.ci95_share
        suggested.append(
            asdict(
                Suggested(
                    seed,
                    rank,
                    judged.candidates[row].where,
                    100.0 * found.gain_share,
                    100.0 * low,
                    100.0 * high,
                    100.0 * real,
                    placed,
                    float(judged.overlap_shares[row]),
                    float(searched[row]),
                    float(searched[judged.allowed].max()),
                )
            )
        )
    return suggested


def ranked(judged: Candidates) -> IntArray:
    """Return the allowed candidates, the most promising first."""
    gains = judged.chance.sum(axis=1)
    allowed = np.flatnonzero(judged.allowed)
    return allowed[np.argsort(-gains[allowed], kind="stable")]


def _searched(
    seen: SeenPlace, judged: Candidates, scene: Scene, renderer: Renderer, truth: RigTruth, seed: int
) -> FloatArray:
    """Return (C,) share of the rays that each rendered candidate newly measures; 0 for those not allowed."""
    points_m = _true_points_m(seen, truth)
    small = scaled(scene.intrinsics, SEARCH_SCALE)
    shares = np.zeros(len(judged.candidates))
    for row in np.flatnonzero(judged.allowed):
        pose = judged.candidates[row].T_world_camera
        z_m = frame_at(scene, renderer, small, "searched", pose, seed).depth.z_m
        depth_m, inside, u, v = pixels_of(points_m, Camera(small, pose))
        near = np.abs(z_m[v, u] - depth_m[inside]) < NEAR_SHARE * depth_m[inside] + 0.02
        shares[row] = np.count_nonzero(near) * seen.targets.share
    return shares


def _true_points_m(seen: SeenPlace, truth: RigTruth) -> FloatArray:
    """Return (T, 3) places where the targets' rays meet the true surface; far away where they meet none."""
    eyes_m = np.array([view.camera.T_world_camera[:3, 3] for view in seen.views])[seen.targets.view]
    ways_m = seen.targets.points_m - eyes_m
    along = first_hits(triangle_scene(truth.vertices_m, truth.triangles), eyes_m, ways_m)
    return eyes_m + np.where(np.isfinite(along), along, 1e3)[:, None] * ways_m

"""How long it takes to register two clouds of 100,000 points, ours and the peers' programs side by side."""

from __future__ import annotations

import statistics
from dataclasses import dataclass

import numpy as np

from lab.benchmarks.benchmark import Benchmark, run_alone
from lab.worlds.demos import build_demo, sense_depth
from lab.worlds.render import Renderer
from packetmesh.memory import peak_memory_bytes
from pipeline.acquisition import back_project
from pipeline.config import RegistrationConfig
from pipeline.geometry import inverse, rigid, rotation_exp
from pipeline.registration import point_error_m, register_timed
from pipeline.registration.peers import available_peers, run_peer
from pipeline.registration.sample import draw
from pipeline.types import FloatArray, PointCloud, RgbdFrame

POINTS = 100_000
GATE_M = 0.25
MOTION = rigid(rotation_exp(np.radians(6.0) * np.array([0.36, 0.8, -0.48])), np.array([0.10, -0.03, 0.08]))
"""Of the second camera in the frame of the first: 6 degrees and 13 cm."""
OURS = "ceicp-a"
RIVALS = ("open3d-point", "open3d-plane", "open3d-gicp", "small-gicp", "small-vgicp", "small-gicp-staged")
"""CPD is left out: it takes part in comparisons of accuracy, on few points."""
MAX_ITERATIONS = 300
"""More than any of them needs."""
ROUNDS = 5


@dataclass(frozen=True, slots=True)
class SpeedPair:
    """Two views of a room by the model of the Kinect, and the truth about them."""

    source: PointCloud
    target: PointCloud
    T_true: FloatArray
    """(4, 4) T_target_source."""


def speed_pair(points: int = POINTS, seed: int = 0) -> SpeedPair:
    """The living room from its first camera and from ``MOTION`` beside it, ``points`` each."""
    scene = build_demo("living-room")
    renderer = Renderer(scene)
    clouds = []
    for view_index, camera in enumerate((scene.cameras[0], scene.cameras[0] @ MOTION)):
        rng = np.random.default_rng([seed, view_index])
        view = renderer.view(scene.intrinsics, camera, "fast", rng)
        frame = RgbdFrame(
            "view", view.rgb, sense_depth(view, scene.intrinsics, rng), scene.intrinsics, camera
        )
        cloud = back_project(frame)
        rows = np.sort(rng.choice(len(cloud), points, replace=False))
        clouds.append(PointCloud(cloud.points_m[rows]))
    target, source = clouds
    return SpeedPair(source, target, inverse(scene.cameras[0]) @ (scene.cameras[0] @ MOTION))


def thinned(pair: SpeedPair) -> SpeedPair:
    """The random subsets that our method takes of the clouds, so that the peers have no more to do."""
    config = RegistrationConfig()
    clouds = [
        draw(cloud, config.max_points, config.seed, "speed").cloud for cloud in (pair.source, pair.target)
    ]
    return SpeedPair(clouds[0], clouds[1], pair.T_true)


def benchmark(peers_thinned: bool) -> Benchmark:
    """Ours and every rival in turn, round by round, after one round to warm up.

    Each program's memory is that of a process that does nothing else, libraries and clouds included.

    Args:
        peers_thinned: give the rivals only the points that ours takes, instead of all.
    """
    pair = speed_pair()
    names = (OURS, *(name for name in RIVALS if name in available_peers()))
    pairs = {name: thinned(pair) if peers_thinned and name != OURS else pair for name in names}
    runs = [{name: _run(name, pairs[name]) for name in names} for _ in range(ROUNDS + 1)][1:]
    seconds, errors_m = (
        {name: statistics.median(run[name][value] for run in runs) for name in names} for value in (0, 1)
    )
    memory = {name: run_alone(_memory, name, pairs[name]) for name in names}
    return Benchmark(seconds.pop(OURS), seconds, memory.pop(OURS), memory, errors_m)


def _run(name: str, pair: SpeedPair) -> tuple[float, float]:
    """Seconds from points to pose, and the point error in metres."""
    if name == OURS:
        config = RegistrationConfig(gate_m=GATE_M, max_iterations=MAX_ITERATIONS)
        result, times_s = register_timed(pair.source, pair.target, config)
        T, elapsed_s = result.T_target_source, float(times_s[-1])
    else:
        peer = run_peer(name, pair.source, pair.target, GATE_M, max_iterations=MAX_ITERATIONS)
        T, elapsed_s = peer.T_target_source, peer.elapsed_s
    return elapsed_s, point_error_m(T, pair.T_true, pair.source.points_m)


def _memory(name: str, pair: SpeedPair) -> int:
    _run(name, pair)
    return peak_memory_bytes()

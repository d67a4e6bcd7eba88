"""Time and memory of registering two clouds, by PacketMesh and by other programs in the same run."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Literal, TypeAlias

import numpy as np

from lab.benchmarks.benchmark import Benchmark, run_alone
from lab.worlds.demos import build_demo, sense_depth
from lab.worlds.render import Renderer
from packetmesh.memory import peak_memory_bytes
from pipeline.acquisition import back_project
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import inverse, rigid, rotation_exp
from pipeline.registration import point_error_m, register_timed
from pipeline.registration.peers import available_peers, run_peer
from pipeline.registration.sample import draw
from pipeline.types import FloatArray, PointCloud, RgbdFrame

POINTS = 100_000
GATE_M = 0.25
MOTION = rigid(rotation_exp(np.radians(6.0) * np.array([0.36, 0.8, -0.48])), np.array([0.10, -0.03, 0.08]))
"""Pose of the second camera in the frame of the first: 6 degrees and 13 cm."""
OURS = "ceicp-a"
RIVALS = ("open3d-point", "open3d-plane", "open3d-gicp", "small-gicp", "small-vgicp", "small-gicp-staged")
"""Compared programs. CPD is left out: it takes part in comparisons of accuracy, on few points."""
MAX_ITERATIONS = 300
"""Iteration limit, which none of them reaches."""
ROUNDS = 15
Drawn: TypeAlias = Literal["ours", "both", "none"]
"""Programs that register only as many points as ours draws by default: ours, ours and the others, or none."""


@dataclass(frozen=True, slots=True)
class SpeedPair:
    """Two views of a room by the Kinect model, and their true pose."""

    source: PointCloud
    target: PointCloud
    T_true: FloatArray
    """(4, 4) T_target_source."""


def speed_pair(points: int = POINTS, seed: int = 0) -> SpeedPair:
    """Return two clouds of ``points`` points of the living room.

    The target is seen by the scene's first camera, the source by a camera at ``MOTION`` from it.
    """
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
    """Return the random subsets that our method takes, so that the peers register equally many points."""
    config = RegistrationConfig()
    clouds = [
        draw(cloud, config.max_points, config.seed, "speed").cloud for cloud in (pair.source, pair.target)
    ]
    return SpeedPair(clouds[0], clouds[1], pair.T_true)


def benchmark(points: int, drawn: Drawn) -> Benchmark:
    """Run ours and every installed rival in turn, round by round, each after a warm-up run of its own.

    Without the warm-up the time depends on the previous program, whose threads continue to spin for a while
    after its end and whose data are in the caches. Each program's memory is that of a process that does
    nothing else, including libraries and clouds.

    Args:
        points: number of points of each cloud.
        drawn: programs that register only the points that ours draws.
    """
    pair = speed_pair(points)
    few = thinned(pair) if drawn == "both" else pair
    names = (OURS, *(name for name in RIVALS if name in available_peers()))
    pairs = {name: pair if name == OURS else few for name in names}
    most = points if drawn == "none" else RegistrationConfig().max_points
    runs = [{name: _run_again(name, pairs[name], most) for name in names} for _ in range(ROUNDS)]
    seconds, errors_m, late_s = (
        {name: float(fold([getattr(run[name], value) for run in runs])) for name in names}
        for value, fold in (("elapsed_s", np.median), ("error_m", np.median), ("elapsed_s", _late))
    )
    memory = {name: run_alone(_memory, name, pairs[name], most) for name in names}
    note = "95 of 100 within: " + ", ".join(f"{name} {value:.3f} s" for name, value in late_s.items())
    rows = tuple({"program": name, **asdict(run[name])} for run in runs for name in names)
    return Benchmark(seconds.pop(OURS), seconds, memory.pop(OURS), memory, errors_m, rows, (note,))


def _late(values: list[float]) -> float:
    """Return the 95th percentile."""
    return float(np.percentile(values, 95.0))


@dataclass(frozen=True, slots=True)
class _Registered:
    """Time and error of one registration."""

    elapsed_s: float
    """Seconds from points to pose."""
    error_m: float
    """Point error of the pose, metres."""


def _run_again(name: str, pair: SpeedPair, most: int) -> _Registered:
    """Return the second of two registrations."""
    _run(name, pair, most)
    return _run(name, pair, most)


def _run(name: str, pair: SpeedPair, most: int) -> _Registered:
    """Register copies of the clouds, so that nothing is cached; ours draws at most ``most`` points."""
    source, target = (PointCloud(cloud.points_m.copy()) for cloud in (pair.source, pair.target))
    if name == OURS:
        config = RegistrationConfig(gate_m=GATE_M, max_iterations=MAX_ITERATIONS, max_points=most)
        result, times_s = register_timed(source, target, config)
        T, elapsed_s = result.T_target_source, float(times_s[-1])
    else:
        peer = run_peer(name, source, target, GATE_M, max_iterations=MAX_ITERATIONS)
        T, elapsed_s = peer.T_target_source, peer.elapsed_s
    return _Registered(elapsed_s, point_error_m(T, pair.T_true, pair.source.points_m))


def _memory(name: str, pair: SpeedPair, most: int) -> int:
    _run(name, pair, most)
    return peak_memory_bytes()

"""Time and memory of ball pivoting, ours and the peers', each in its own process."""

from __future__ import annotations

import importlib.util
import logging
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import psutil

from lab.benchmarks.benchmark import Benchmark, run_alone
from packetmesh.memory import peak_memory_bytes
from packetmesh.progress import drain
from pipeline.config import PRESETS
from pipeline.io.demos import load_demo
from pipeline.kernels.open3d_runtime import o3d
from pipeline.kernels.rays import tensor, triangle_scene
from pipeline.merging import merge_fused
from pipeline.sources import LoadedRig
from pipeline.spec import Spec
from pipeline.stages import run
from pipeline.surface.pivoting import roll
from pipeline.surface.quality import measure_quality
from pipeline.surface.radii import spacing
from pipeline.surface.smooth import smooth
from pipeline.surface.voxel import voxel_average, voxel_for_count
from pipeline.types import FloatArray, IntArray, PointCloud

logger = logging.getLogger(__name__)

OURS = "packetmesh"
ROOM = "living room"
ROUGH_ROOM = "living room, not smoothed"
TERRAIN = "terrain"
POINTS = 50_000
MANY_POINTS = 1_000_000
BALLS: dict[str, tuple[float, ...]] = {
    "r_F": (1.0,),
    "1.5 r_F": (1.5,),
    "2.5 r_F": (2.5,),
    "4 r_F": (4.0,),
    "r_F, 1.5, 2.5 and 4 r_F": (1.0, 1.5, 2.5, 4.0),
}
"""Radii of the balls by name, as multiples of r_F, the cloud's mean point distance."""
HEADLINE = "r_F, 1.5, 2.5 and 4 r_F"
ROUGH_BALLS = ("1.5 r_F", "4 r_F")
MANY_POINTS_BALLS = ("1.5 r_F", HEADLINE)
ROUNDS = 3
SLOW_S = 20.0
"""A first round longer than this is the only one, seconds."""
MOST_S = 150.0
"""A program that takes longer for all its rounds is stopped and left out, seconds."""
CLOSE_SHARE = 0.5
"""A point is covered if its distance from the mesh is at most this share of r_F."""

Ball = Callable[[FloatArray, FloatArray, Sequence[float]], tuple[FloatArray, IntArray]]


@dataclass(frozen=True, slots=True)
class SurfaceRun:
    """One program's balls over one cloud."""

    program: str
    cloud: str
    balls: str
    points: int
    r_F_m: float
    radii_m: tuple[float, ...]
    elapsed_s: float
    """Median of the rounds."""
    rounds: int
    first_use_s: float
    """Time of the process's first surface, of 100 points; compiled code is read from its cache, if there."""
    peak_memory_bytes: int
    """Peak memory of a process that does nothing else, including libraries and cloud."""
    added_memory_bytes: int
    """The peak minus the memory before the first round."""
    triangles: int
    used_share: float
    """Share of the points that are corners of a triangle."""
    covered_share: float
    """Share of the points with the mesh within half of r_F."""
    non_manifold_edges: int
    boundary_length_m: float


def roll_ours(
    points_m: FloatArray, normals: FloatArray, radii_m: Sequence[float]
) -> tuple[FloatArray, IntArray]:
    """Roll our own ball; return vertices and triangles."""
    return points_m, roll(points_m, normals, radii_m).triangles


def roll_open3d(
    points_m: FloatArray, normals: FloatArray, radii_m: Sequence[float]
) -> tuple[FloatArray, IntArray]:
    """Roll Open3D's ball."""
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points_m))
    cloud.normals = o3d.utility.Vector3dVector(normals)
    mesh = o3d.geometry.TriangleMesh.create_from_point_cloud_ball_pivoting(
        cloud, o3d.utility.DoubleVector(radii_m)
    )
    return np.asarray(mesh.vertices), np.asarray(mesh.triangles)


def roll_meshlab(
    points_m: FloatArray, normals: FloatArray, radii_m: Sequence[float]
) -> tuple[FloatArray, IntArray]:
    """Roll MeshLab's ball with its defaults, once per radius, each on the mesh of the smaller ones."""
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=points_m, v_normals_matrix=normals))
    for radius_m in radii_m:
        meshes.generate_surface_reconstruction_ball_pivoting(ballradius=pymeshlab.PureValue(radius_m))
    mesh = meshes.current_mesh()
    return mesh.vertex_matrix(), mesh.face_matrix()


PROGRAMS: dict[str, Ball] = {OURS: roll_ours, "open3d": roll_open3d, "meshlab": roll_meshlab}


def available_programs() -> tuple[str, ...]:
    """Return our program first, then the installed peers."""
    return tuple(
        name for name in PROGRAMS if name != "meshlab" or importlib.util.find_spec("pymeshlab") is not None
    )


def room_cloud(points: int, smoothed: bool = True) -> PointCloud:
    """Return about ``points`` points of the living room's fused cloud, thinned by voxels and smoothed.

    The depth is rendered with the sensor's noise and filled with the network's. The nodes are at their true
    poses. The points are smoothed as in the chain, or not at all without ``smoothed``.
    """
    rig = load_demo("living-room")
    assert rig.truth is not None
    config = PRESETS["packetmesh"]
    fine = replace(config, surface=replace(config.surface, max_points=3 * points, smoothing_passes=0))
    spec = Spec(LoadedRig(rig), config=fine)
    nodes = drain(run(spec, stages=("nodes",)))["nodes"].value
    surface = fine.surface
    fused = merge_fused(
        rig.frames, nodes, rig.truth.T_world_camera, "fill", surface.max_points, surface.smoothing_passes
    ).fused
    thin = voxel_average(fused, voxel_for_count(fused.points_m, points))
    return smooth(thin, config.surface.smoothing_passes if smoothed else 0)


def terrain(points: int, seed: int = 0, point_distance_m: float = 0.01, noise_m: float = 0.001) -> PointCloud:
    """Return exactly ``points`` on rolling ground, whose area grows with their number, with true normals.

    The ground has waves of 1 m length and 10 cm height. The points are on a jittered grid, with noise in z.
    """
    side = int(np.ceil(np.sqrt(points)))
    rng = np.random.default_rng(seed)
    cells = np.stack(np.divmod(np.arange(points), side), axis=-1)
    x_m, y_m = ((cells + rng.uniform(-0.3, 0.3, cells.shape)) * point_distance_m).T
    turn = 2.0 * np.pi
    z_m = 0.05 * np.sin(turn * x_m) * np.sin(turn * y_m)
    slope_x = 0.05 * turn * np.cos(turn * x_m) * np.sin(turn * y_m)
    slope_y = 0.05 * turn * np.sin(turn * x_m) * np.cos(turn * y_m)
    normals = np.column_stack([-slope_x, -slope_y, np.ones(points)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return PointCloud(np.column_stack([x_m, y_m, z_m + rng.normal(0.0, noise_m, points)]), normals=normals)


def time_alone(
    program: str, cloud: PointCloud, name: str, balls: str, multiples: Sequence[float], rounds: int = ROUNDS
) -> SurfaceRun:
    """Run one program over one cloud, in a fresh process.

    Args:
        program: a name of ``PROGRAMS``.
        cloud: points with normals.
        name: name of the cloud, for the record.
        balls: name of the radii.
        multiples: the radii as multiples of the cloud's r_F, ascending.
        rounds: number of rounds; only one if the first is slow.

    Raises:
        TimeoutError: it took longer than ``MOST_S`` and was stopped.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cloud.npy"  # pickling would count as memory
        np.save(path, np.stack([cloud.points_m, _normals(cloud)]))
        run = run_alone(measure, program, path, multiples, rounds, timeout_s=MOST_S)
    return replace(run, cloud=name, balls=balls)


def measure(program: str, path: Path, multiples: Sequence[float], rounds: int) -> SurfaceRun:
    """Measure time, memory and quality in this process; the names of cloud and balls are left empty."""
    points_m, normals = np.load(path)
    r_F_m, _ = spacing(points_m)
    radii_m = tuple(factor * r_F_m for factor in multiples)
    ball = PROGRAMS[program]
    small = terrain(100)
    started = time.perf_counter()
    ball(small.points_m, _normals(small), [0.02])
    first_use_s = time.perf_counter() - started
    before = psutil.Process().memory_info().rss
    seconds: list[float] = []
    while len(seconds) < rounds and (not seconds or seconds[0] < SLOW_S):
        started = time.perf_counter()
        vertices_m, triangles = ball(points_m, normals, radii_m)
        seconds.append(time.perf_counter() - started)
    peak = peak_memory_bytes()
    used, corners = np.unique(triangles, return_inverse=True)
    quality = measure_quality(vertices_m[used], corners.reshape(-1, 3).astype(np.int32), (), len(points_m))
    return SurfaceRun(
        program=program,
        cloud="",
        balls="",
        points=len(points_m),
        r_F_m=r_F_m,
        radii_m=radii_m,
        elapsed_s=statistics.median(seconds),
        rounds=len(seconds),
        first_use_s=first_use_s,
        peak_memory_bytes=peak,
        added_memory_bytes=max(0, peak - before),
        triangles=len(triangles),
        used_share=len(used) / len(points_m),
        covered_share=_covered_share(points_m, vertices_m, triangles, CLOSE_SHARE * r_F_m),
        non_manifold_edges=quality.non_manifold_edges,
        boundary_length_m=quality.boundary_length_m,
    )


def _normals(cloud: PointCloud) -> FloatArray:
    assert cloud.normals is not None
    return cloud.normals


def _covered_share(points_m: FloatArray, vertices_m: FloatArray, triangles: IntArray, near_m: float) -> float:
    if not len(triangles):
        return 0.0
    distances_m = triangle_scene(vertices_m, triangles).compute_distance(tensor(points_m, np.float32)).numpy()
    return float((distances_m <= near_m).mean())


def benchmark() -> Benchmark:
    """Measure ball pivoting of about 50,000 points; the times are those of all four balls together."""
    runs = tuple(measure_speed())
    chosen = {run.program: run for run in runs if run.cloud == ROOM and run.balls == HEADLINE}
    seconds = {name: run.elapsed_s for name, run in chosen.items()}
    memory = {name: run.peak_memory_bytes for name, run in chosen.items()}
    return Benchmark(
        seconds.pop(OURS), seconds, memory.pop(OURS), memory, runs=tuple(asdict(run) for run in runs)
    )


def measure_speed() -> Iterator[SurfaceRun]:
    """Yield the runs of all programs on the room, smoothed and not, and of ours on terrain of many points."""
    programs = available_programs()
    room = room_cloud(POINTS)
    cases = [(room, ROOM, balls, programs) for balls in BALLS]
    rough = room_cloud(POINTS, smoothed=False)
    cases += [(rough, ROUGH_ROOM, balls, programs) for balls in ROUGH_BALLS]
    wide = terrain(MANY_POINTS)
    cases += [(wide, TERRAIN, balls, (OURS,)) for balls in MANY_POINTS_BALLS]
    for cloud, name, balls, rivals in cases:
        for program in rivals:
            try:
                yield time_alone(program, cloud, name, balls, BALLS[balls])
            except TimeoutError:
                logger.warning("%s took more than %.0f s for %s on the %s", program, MOST_S, balls, name)

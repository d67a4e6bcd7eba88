"""The surface benchmark gives everyone the same cloud and knows what good surfaces look like."""

import json
from dataclasses import replace

import numpy as np
import pytest

from lab.benchmarks import CASES
from lab.benchmarks import surface as surface_speed
from lab.benchmarks.surface import (
    OURS,
    PROGRAMS,
    available_programs,
    measure_speed,
    room_cloud,
    terrain,
    time_alone,
)
from lab.claims.surface import growth
from pipeline.surface.radii import spacing

BOTH = (OURS, "open3d")


def test_a_terrain_has_its_points_and_one_density_at_every_size():
    clouds = [terrain(n) for n in (1000, 16_000)]
    assert [len(cloud) for cloud in clouds] == [1000, 16_000]
    small, large = (spacing(cloud.points_m) for cloud in clouds)
    assert large == pytest.approx(small, rel=0.05)
    areas_m2 = [np.prod(np.ptp(cloud.points_m[:, :2], axis=0)) for cloud in clouds]
    assert areas_m2[1] / areas_m2[0] == pytest.approx(16, rel=0.1)
    np.testing.assert_allclose(np.linalg.norm(clouds[1].normals, axis=1), 1.0)


def test_the_terrain_s_normals_are_those_of_its_waves():
    cloud = terrain(4000, noise_m=0.0)
    x_m, y_m, z_m = cloud.points_m.T

    def height_m(x_m, y_m):
        return 0.05 * np.sin(2 * np.pi * x_m) * np.sin(2 * np.pi * y_m)

    np.testing.assert_allclose(z_m, height_m(x_m, y_m), atol=1e-12)
    step_m = 1e-6
    slopes = [
        (height_m(x_m + step_m, y_m) - height_m(x_m - step_m, y_m)) / (2 * step_m),
        (height_m(x_m, y_m + step_m) - height_m(x_m, y_m - step_m)) / (2 * step_m),
    ]
    np.testing.assert_allclose(-cloud.normals[:, :2].T / cloud.normals[:, 2], slopes, atol=1e-6)


def test_a_room_is_thinned_to_about_the_points_that_were_asked_for():
    room = room_cloud(3000)
    assert len(room) == pytest.approx(3000, rel=0.03)
    assert room.normals is not None


@pytest.mark.parametrize("program", available_programs())
def test_every_program_covers_a_terrain(tmp_path, program):
    cloud = terrain(2500)
    np.save(tmp_path / "cloud.npy", np.stack([cloud.points_m, cloud.normals]))
    run = surface_speed.measure(program, tmp_path / "cloud.npy", (1.5, 2.5), rounds=2)
    assert (run.points, run.rounds, run.program) == (2500, 2, program)
    assert run.radii_m == pytest.approx([1.5 * run.r_F_m, 2.5 * run.r_F_m])
    assert run.covered_share > 0.98
    assert run.used_share > 0.95
    assert run.non_manifold_edges == 0
    assert run.triangles == pytest.approx(2 * 2500, rel=0.1)
    assert run.boundary_length_m == pytest.approx(4 * 0.5, rel=0.5)


def test_ours_and_open3d_are_always_there_and_meshlab_may_be():
    assert available_programs()[:2] == BOTH
    assert set(available_programs()) <= set(PROGRAMS)


def test_a_slow_first_round_is_the_only_one(tmp_path, monkeypatch):
    cloud = terrain(400)
    np.save(tmp_path / "cloud.npy", np.stack([cloud.points_m, cloud.normals]))
    monkeypatch.setattr(surface_speed, "SLOW_S", 0.0)
    assert surface_speed.measure(OURS, tmp_path / "cloud.npy", (1.5,), rounds=3).rounds == 1


def test_a_fresh_process_measures_its_own_memory():
    run = time_alone(OURS, terrain(2000), "small", "one", (1.5,), rounds=1)
    assert (run.cloud, run.balls, run.points) == ("small", "one", 2000)
    assert run.peak_memory_bytes > 50e6
    assert run.added_memory_bytes < run.peak_memory_bytes
    assert run.elapsed_s > 0


def test_the_case_takes_its_numbers_from_the_four_balls(monkeypatch):
    def alone(program, cloud, name, balls, multiples):
        seconds = len(multiples) * (1.0 if program == OURS else 2.0)
        return replace(_run(len(cloud), seconds, program), cloud=name, balls=balls)

    monkeypatch.setattr(surface_speed, "time_alone", alone)
    monkeypatch.setattr(surface_speed, "room_cloud", lambda points, smoothed=True: terrain(100))
    monkeypatch.setattr(surface_speed, "MANY_POINTS", 400)
    monkeypatch.setattr(surface_speed, "available_programs", lambda: BOTH)
    runs = list(measure_speed())
    assert [(run.program, run.balls) for run in runs[:2]] == [(OURS, "r_F"), ("open3d", "r_F")]
    assert len(runs) == 2 * 7 + 2
    assert [run.points for run in runs] == [100] * 14 + [400] * 2
    record = CASES["surface"]().record()
    assert record["ours_s"] == 4.0
    assert record["peers"] == {"open3d": 8.0}
    assert record["ratio"] == 0.5
    assert len(record["runs"]) == 16
    json.dumps(record, allow_nan=False)


def _run(points: int, seconds: float, program: str = OURS) -> surface_speed.SurfaceRun:
    after = (3, 0.5, 10**8, 10**7, 2 * points, 1.0, 1.0, 0, 2.0)
    return surface_speed.SurfaceRun(program, "t", "four", points, 0.01, (0.01,), seconds, *after)


@pytest.mark.parametrize(
    ("time", "storage", "reproduced"), [(1.05, 1.0, True), (1.3, 1.0, False), (1.0, 0.7, False)]
)
def test_c24_needs_both_slopes(time, storage, reproduced):
    sizes = (10**4, 10**5, 10**6)
    outcome = growth.judge(
        growth.Growth(
            tuple(_run(n, 1e-6 * n**time) for n in sizes),
            tuple(_run(n, 1e-5 * n, "open3d") for n in sizes[:2]),
            tuple(int(400 * n**storage) for n in sizes),
        )
    )
    assert outcome.reproduced == reproduced
    assert outcome.ours["time_slope"] == pytest.approx(time)
    chart, table = outcome.exhibits
    assert chart.logarithmic
    assert [curve.label for curve in chart.curves][:2] == ["packetmesh", "Open3D"]
    assert table.rows[-1][3] is None
    assert {len(row) for row in table.rows} == {len(table.header)}

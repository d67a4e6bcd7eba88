"""C21 to C24 measure what they say on targets with known answers, and judge by their own rules."""

import json
from dataclasses import replace

import numpy as np
import pytest

from app.reports.reproduction import write_reproduction_report
from lab.claims.claim import Claim
from lab.claims.exhibits import Chart, Table
from lab.claims.surface import detail, growth, holes, rule
from lab.claims.surface.clouds import CHAINS, chain_clouds
from lab.claims.surface.figures import FIGURES, thesis_figures
from lab.claims.surface.stairs import (
    NOISE_M,
    RISES_M,
    TREAD_M,
    WIDTH_M,
    feet_samples,
    stairs,
    stairs_cloud,
)
from packetmesh.files import finite
from pipeline.config import PRESETS
from pipeline.io.demos import load_demo
from pipeline.kernels.rays import tensor, triangle_areas_m2, triangle_scene
from pipeline.surface.pictures import MISSED
from pipeline.surface.radii import spacing


def _distances_m(vertices_m, triangles, points_m):
    return triangle_scene(vertices_m, triangles).compute_distance(tensor(points_m, np.float32)).numpy()


# C21


def test_the_rule_gives_the_printed_radii_and_even_steps_do_not():
    sigmas = rule.READINGS["r_F + {0, 1/4, 1/2, 1} sigma_D"]
    spacing_m = rule.inferred_spacing(sigmas)
    assert spacing_m == pytest.approx((0.0102, 0.0107))
    radii_m = rule.predicted_radii_m(sigmas, *spacing_m)
    assert np.round(radii_m, 4) == pytest.approx([0.0102, 0.0129, 0.0155, 0.0209], abs=1.01e-4)
    assert rule.deviation(radii_m) < 0.02
    even = (0.0, 1 / 3, 2 / 3, 1.0)
    assert rule.deviation(rule.predicted_radii_m(even, *spacing_m)) > 0.1


def test_half_the_sigma_and_twice_the_multiples_are_the_same_radii():
    table = rule.readings_table()
    rows = {row[0]: row for row in table.rows}
    ours, twice = (
        rows["r_F + {0, 1/4, 1/2, 1} sigma_D"],
        rows["r_F + {0, 1/2, 1, 2} sigma_D"],
    )
    assert ours[3:] == pytest.approx(twice[3:])
    assert ours[2] == pytest.approx(2 * twice[2])
    assert {len(row) for row in table.rows} == {len(table.header)}


# C22


@pytest.fixture(scope="module")
def small_clouds():
    """The thesis's chain on a node, thinned to few points."""
    config = PRESETS["thesis"]
    config = replace(config, surface=replace(config.surface, max_points=3000))
    return chain_clouds(load_demo("box-on-table"), 0, config)


def test_a_chain_s_clouds_have_the_spacing_of_the_fused_one(small_clouds):
    merged = small_clouds.merged
    assert len(merged.fused) == pytest.approx(3000, rel=0.1)
    assert len(merged.sensor) < len(merged.fused)
    assert (merged.r_F_m, merged.sigma_D_m) == spacing(merged.fused.points_m)
    assert small_clouds.name == "box-on-table/node_00"


def test_a_larger_ball_misses_fewer_rays_and_shares_are_shares(small_clouds):
    small, large = (holes.seen(small_clouds, "after", (factor,)) for factor in (0.0, 4.0))
    assert 0.0 <= large.no_hit_share < small.no_hit_share <= 1.0
    assert small.close_share < large.close_share <= 1.0 - large.no_hit_share + 0.05
    assert 0.0 < large.median_depth_error_m < 0.2
    assert large.loops > 0


def test_the_figures_are_the_thesis_s_six_with_what_they_miss_in_magenta(small_clouds):
    picture, merged = thesis_figures(small_clouds, "the union"), small_clouds.merged
    assert len(picture.images) == len(FIGURES) == 6
    for (number, when, _, factor), (caption, rgb) in zip(FIGURES, picture.images, strict=True):
        assert rgb.shape == (240, 320, 3)
        assert caption.startswith(f"{number}: {when} fusion")
        assert f"{1000 * (merged.r_F_m + factor * merged.sigma_D_m):.1f} mm" in caption
        assert f"{np.all(rgb == MISSED, axis=2).mean():.0%} of the rays" in caption


def _measured(after: float, loops: int = 10) -> holes.Measured:
    """Three made-up frames: half of the rays lost before fusion and ``after`` lost after it."""
    lost = {"before": 0.5, "after": after}
    return {
        (preset, when, name): [holes.Seen(lost[when] + 0.01 * frame, 0.6, 0.004, loops) for frame in range(3)]
        for preset in CHAINS
        for when in lost
        for name in holes.RULES
    }


def test_c22_needs_the_rays_halved():
    assert holes.judge(_measured(0.2)).reproduced
    assert not holes.judge(_measured(0.26)).reproduced
    ours = holes.judge(_measured(0.2, loops=7)).ours
    assert ours["no_hit_before_thesis"] == pytest.approx(0.51)
    assert ours["no_hit_after_packetmesh"] == pytest.approx(0.21)
    assert ours["loops_after_thesis"] == 7
    assert ours["close_before_packetmesh"] == pytest.approx(0.6)


def test_c22_shows_every_cloud_by_every_rule():
    rays, loops = holes.judge(_measured(0.2)).exhibits
    assert rays.header[1:] == loops.header[1:] == tuple(holes.RULES)
    assert len(rays.rows) == len(loops.rows) == 4
    assert rays.rows[0][1] == "51% / 60% / 0.4 cm"


def test_a_verdict_with_pictures_is_strict_json_and_a_page(tmp_path, small_clouds):
    picture = thesis_figures(small_clouds, "the union")
    claim = Claim("C22", "c", "t", "tol", lambda: holes.judge(_measured(0.2), (picture,)))
    verdict = claim.judge()
    record = json.loads(json.dumps(finite(verdict.record()), allow_nan=False))
    assert record["exhibits"][2] == {
        "title": picture.title,
        "images": [{"caption": caption, "width_px": 320, "height_px": 240} for caption, _ in picture.images],
        "note": picture.note,
    }
    assert record["exhibits"][0]["header"][0] == "cloud"
    write_reproduction_report([verdict], tmp_path / "r.html")
    assert (tmp_path / "r.html").read_text().count("data:image/png;base64,") == 6


# C23


def test_the_stairs_have_the_area_of_their_treads_and_risers():
    target = stairs()
    length_m = (len(RISES_M) + 1) * TREAD_M + sum(RISES_M)
    assert triangle_areas_m2(target.vertices_m, target.triangles).sum() == pytest.approx(WIDTH_M * length_m)
    assert np.diff(target.feet_m[:, 1]) == pytest.approx(RISES_M[:-1])
    assert target.vertices_m[:, 2].max() == pytest.approx(sum(RISES_M))
    feet_m = feet_samples(target)
    assert len(feet_m) == 100 * len(RISES_M)
    assert _distances_m(target.vertices_m, target.triangles, feet_m).max() < 1e-6


def test_a_cloud_of_the_stairs_lies_on_them_with_the_noise_and_the_normals_look_out():
    target = stairs()
    exact = stairs_cloud(target, 0, noise_m=0.0)
    assert _distances_m(target.vertices_m, target.triangles, exact.points_m).max() < 1e-5
    noisy = stairs_cloud(target, 0)
    moved_m = noisy.points_m - exact.points_m
    assert moved_m.std(axis=0) == pytest.approx([NOISE_M] * 3, rel=0.05)
    up_or_front = np.abs(exact.normals[:, 2]) + np.abs(exact.normals[:, 1])
    assert np.mean(exact.normals[:, 2] - exact.normals[:, 1] > 0) > 0.99
    assert np.mean(up_or_front > 0.99) > 0.95


def test_a_large_ball_cannot_reach_the_feet_of_the_steps():
    small, large = detail.details(0, spacings=(1.5, 6.0))
    assert large.radius_m == pytest.approx(4 * small.radius_m)
    assert small.accuracy_1cm > 0.99 > 0.9 > large.accuracy_1cm
    assert small.coverage_1cm > 0.98
    assert small.foot_gap_m < small.radius_m / 2**0.5 < large.foot_gap_m < large.radius_m


def _run(*accuracies: float) -> list[detail.Detail]:
    return [detail.Detail(0.01 * k, value, 0.9, 0.01 * k) for k, value in enumerate(accuracies, 1)]


@pytest.mark.parametrize(
    ("accuracies", "reproduced"),
    [
        ((1.0, 0.9, 0.8, 0.7), True),
        ((1.0, 1.0, 0.9, 0.8), True),
        ((0.9, 1.0, 0.7, 0.8), False),
        ((1.0, 1.0, 1.0, 1.0), False),
        ((0.7, 0.8, 0.9, 1.0), False),
    ],
)
def test_c23_needs_a_fall_of_the_accuracy(accuracies, reproduced):
    outcome = detail.judge([_run(*accuracies)] * 3, spacings=(1, 2, 3, 4))
    assert outcome.reproduced == reproduced
    chart, table = outcome.exhibits
    assert isinstance(chart, Chart)
    assert isinstance(table, Table)
    fitted = chart.curves[-1].y
    assert list(fitted) == sorted(fitted, reverse=True)
    assert len(table.rows) == 4


# C24


@pytest.mark.parametrize("exponent", [0.5, 1.0, 1.4])
def test_the_slope_of_a_power_law_is_its_exponent(exponent):
    counts = np.array([1e4, 1e5, 1e6])
    slope = growth.fit_slope(counts, 3e-6 * counts**exponent)
    assert slope.exponent == pytest.approx(exponent)
    assert slope.ci95 == pytest.approx((exponent, exponent), abs=1e-6)
    assert slope.factor == pytest.approx(3e-6)
    assert slope.is_linear == (exponent == 1.0)


def test_the_interval_of_a_slope_is_that_of_student():
    counts, values = np.exp([0.0, 1.0, 2.0, 3.0]), np.exp([0.1, 0.9, 2.1, 2.9])
    low, high = growth.fit_slope(counts, values).ci95
    residuals = np.array([0.04, -0.12, 0.12, -0.04])
    error = np.sqrt(np.sum(residuals**2) / 2 / 5.0)
    assert (high - low) / 2 == pytest.approx(4.3027 * error, rel=1e-4)


def test_storage_grows_linearly_with_the_cloud_and_covers_the_result():
    few, many = (growth.terrain(n) for n in (8_000, 64_000))
    held = [growth.storage_bytes(cloud, (0.012,)) for cloud in (few, many)]
    assert held[1] / held[0] == pytest.approx(8.0, rel=0.1)
    assert held[0] > 2 * 8_000 * (3 * 4 + 3 * 8)

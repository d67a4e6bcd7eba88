"""The estimated bias and noise of a depth sensor against those it has, and its own word on how sure it is."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import sem

from lab.worlds.printed import printed, sheet_px
from packetmesh.errors import InputError
from pipeline.calibration import depth_from_images, depth_samples
from pipeline.calibration.board import Board
from pipeline.calibration.depth_bias import fit_depth
from pipeline.calibration.depth_from_images import with_depth
from pipeline.calibration.depth_samples import board_depth_samples
from pipeline.calibration.detection import whole
from pipeline.calibration.estimate import calibrate
from pipeline.calibration.from_images import CameraReport
from pipeline.calibration.lens import Optics
from pipeline.io.depth_correction import (
    DepthCorrection,
    map_means,
    read_depth_correction,
    write_depth_correction,
)
from pipeline.io.images import write_depth_mm
from pipeline.kernels.geometry import apply, inverse
from pipeline.types import DepthMap
from tests.pipeline.calibration.depth_views import (
    BOARD,
    CAMERA,
    NOISE,
    RAYS,
    SIZE,
    depth_of,
    poses,
    quick_samples,
    samples,
    view_of,
)

MAP = 0.008 * np.array([[1.0, -1.0, 0.5, 0.0], [-0.5, -0.8, 0.0, 1.0], [0.6, 0.2, -1.0, 0.3]])
MAP -= (MAP * map_means()).sum()
NONE = DepthCorrection(SIZE)
LINEAR = DepthCorrection(SIZE, 0.03, 1.01)
CURVED = DepthCorrection(SIZE, 0.02, 0.98, -0.01)
MAPPED = DepthCorrection(SIZE, -0.01, 1.02, 0.008, MAP)
FIELDS = {"offset": "offset_m", "scale": "scale", "curvature": "curvature_per_m", "map": "map_coefficients"}


def off_sds(fit, truth):
    """How far each parameter is off, in its own standard errors."""
    wide = 2.0 * 2.13  # Student's quantile of 16 views, about
    found = fit.correction
    return {
        term: (getattr(found, FIELDS[term]) - getattr(truth, FIELDS[term]))
        / (np.ptp(found.ci95[FIELDS[term]], axis=-1) / wide)
        for term in fit.terms
    }


@pytest.mark.parametrize(
    ("truth", "terms"),
    [(LINEAR, ("offset", "scale")), (CURVED, ("offset", "scale", "curvature"))],
    ids=["linear", "curved"],
)
def test_from_images_the_terms_that_a_sensor_has_are_found_within_three_standard_errors(truth, terms):
    fit = fit_depth(samples(truth, seed=0))
    assert fit.terms == terms
    assert all(np.abs(value).max() < 3.0 for value in off_sds(fit, truth).values())
    assert fit.rms_after_m < 0.3 * fit.rms_before_m
    # A focal length that is off looks like a scale, and the views say by how much that may be.
    assert 0.3 < fit.scale_focal_correlation <= 1.0


def test_a_map_over_the_image_is_found_where_boards_were_held_everywhere():
    fit = fit_depth(quick_samples(MAPPED, seed=1, count=40))
    assert fit.terms == ("offset", "scale", "curvature", "map")
    assert all(np.abs(value).max() < 3.5 for value in off_sds(fit, MAPPED).values())
    off = fit.correction.map_over_image() - MAPPED.map_over_image()
    assert np.sqrt((off**2).mean()) < 0.25 * np.sqrt((MAPPED.map_over_image() ** 2).mean())


def test_errors_are_as_large_as_the_intervals_say():
    off = [off_sds(fit_depth(quick_samples(LINEAR, seed)), LINEAR) for seed in range(16)]
    for term in ("offset", "scale"):
        values = np.array([one[term] for one in off if term in one])
        assert len(values) >= 15
        assert 0.6 < np.sqrt((values**2).mean()) < 1.4


def test_the_bias_at_a_depth_is_what_the_correction_takes_off_and_as_sure_as_its_parameters():
    fit = fit_depth(quick_samples(CURVED, seed=0))
    assert fit.terms == ("offset", "scale", "curvature")
    z_m = np.array([0.6, 1.0, 1.7])
    bias_m, half_m = fit.bias_m(z_m)
    np.testing.assert_allclose(bias_m, z_m - fit.correction.corrected_m(z_m, np.zeros((3, 2))), atol=1e-12)
    by_terms = np.stack([z_m**0, z_m, z_m**2])
    variances_m2 = np.diag(by_terms.T @ fit.covariance @ by_terms)
    np.testing.assert_allclose(half_m**2 / half_m[0] ** 2, variances_m2 / variances_m2[0], rtol=1e-9)
    low_m, high_m = fit.correction.ci95["offset_m"]  # the same interval as that of the offset, which is at 0
    assert fit.bias_m(np.zeros(1))[1][0] == pytest.approx(0.5 * (high_m - low_m), rel=1e-9)


def test_a_sensor_without_bias_is_left_alone_most_times():
    found = [fit_depth(quick_samples(NONE, 100 + seed)).terms for seed in range(16)]
    assert sum(terms == () for terms in found) >= 13


def test_a_wrong_focal_length_alone_is_not_taken_for_the_sensors_scale():
    of_lens = [quick_samples(NONE, seed, lens_share=0.004) for seed in range(12)]
    assert sum("scale" in fit_depth(one).terms for one in of_lens) <= 2
    assert any(abs(np.mean(one.measured_m / one.true_m) - 1.0) > 0.004 for one in of_lens)


def test_the_middle_of_tilted_boards_has_the_wrong_sign_and_the_plane_the_right_one():
    rng = np.random.default_rng(3)
    boards = poses(rng)
    for T, away_m in zip(boards, np.geomspace(0.5, 1.8, len(boards)), strict=True):
        # Turned about the vertical, and its middle to the left of the image's, where the board is nearer.
        turn = np.radians(35.0 + rng.uniform(-5.0, 5.0))
        T[:3, :3] = [
            [np.cos(turn), 0.0, -np.sin(turn)],
            [0.0, 1.0, 0.0],
            [np.sin(turn), 0.0, np.cos(turn)],
        ]
        T[:3, 3] = (-0.1, rng.uniform(-0.02, 0.02), away_m)
    truth = DepthCorrection(SIZE, 0.0, 1.03)
    depths = [depth_of(T, truth, NOISE, rng) for T in boards]
    middle = [depth.z_m[243, 318] - T[2, 3] for T, depth in zip(boards, depths, strict=True)]
    assert np.mean(middle) > 0.01  # as if the sensor measured too much
    tilted = poses(rng, 8)
    views = [view_of(T, 0.2, rng) for T in (*boards, *tilted)]
    fit = fit_depth(board_depth_samples(calibrate(views, SIZE), [*depths, *[None] * 8], BOARD))
    corrected = fit.correction.corrected_m(np.array([1.0, 1.5]), np.full((2, 2), (318, 243)))
    np.testing.assert_allclose(corrected, [1.03, 1.545], atol=0.004)


def test_the_noise_law_is_found():
    fit = fit_depth(quick_samples(LINEAR, seed=5, count=30))
    z_m, cosine = np.array([0.6, 1.0, 1.4, 1.8]), np.array([0.95, 0.8, 0.9, 0.75])
    np.testing.assert_allclose(fit.correction.noise.sd_m(z_m, cosine), NOISE.sd_m(z_m, cosine), rtol=0.08)
    for name in ("s0_m", "s1_m", "p", "q"):
        low, high = fit.correction.ci95[name]
        assert low <= getattr(fit.correction.noise, name) <= high


def test_boards_at_one_distance_give_an_offset_or_a_scale_and_say_why_not_both():
    fit = fit_depth(quick_samples(DepthCorrection(SIZE, 0.02), seed=2, range_m=(0.75, 0.85)))
    assert fit.terms in (("offset",), ("scale",))
    assert "offset from a scale" in fit.note
    corrected_m = fit.correction.corrected_m(np.array([0.8]), np.array([[320, 240]]))
    assert corrected_m[0] == pytest.approx(0.82, abs=0.003)


def test_parts_of_the_image_without_boards_have_no_map():
    some = quick_samples(MAPPED, seed=4)
    left = some.select(some.pixels[:, 0] < 400)
    fit = fit_depth(left)
    assert "map" not in fit.terms
    assert "image's 12 parts" in fit.note


def test_hands_before_the_board_and_ink_change_nothing():
    some = quick_samples(LINEAR, seed=6)
    rng = np.random.default_rng(0)
    hand = rng.random(len(some)) < 0.05
    fooled = replace(some, measured_m=np.where(hand, some.measured_m - 0.015, some.measured_m))
    plain, robust = fit_depth(some).correction, fit_depth(fooled).correction
    assert robust.offset_m == pytest.approx(plain.offset_m, abs=0.001)
    black = rng.random(len(some)) < 0.2
    inked = replace(some, ink=black, measured_m=some.measured_m + 0.01 * black)
    fit = fit_depth(inked)
    assert fit.correction.offset_m == pytest.approx(plain.offset_m, abs=0.001)
    offset_m, sd_m = fit.ink_offset_m
    assert abs(offset_m - 0.01) < 3.0 * sd_m + 5e-4
    off_m = fit.correction.corrected_m(inked.measured_m, inked.pixels) - inked.true_m
    apart_m = [
        np.median(off_m[(inked.view == one) & black]) - np.median(off_m[(inked.view == one) & ~black])
        for one in np.unique(inked.view)
    ]
    assert (offset_m, sd_m) == pytest.approx((np.mean(apart_m), sem(apart_m)))


def test_what_is_found_goes_through_its_file(tmp_path):
    fit = fit_depth(quick_samples(MAPPED, seed=1, count=40))
    write_depth_correction(tmp_path / "depth_correction.json", fit.correction)
    again = read_depth_correction(tmp_path / "depth_correction.json")
    z_m = DepthMap(np.full(SIZE[::-1], 1.3, np.float32))
    np.testing.assert_array_equal(again.apply(z_m).z_m, fit.correction.apply(z_m).z_m)
    told = fit.metrics()
    assert told["terms"] == list(fit.terms)
    assert told["values"]["scale"] == again.scale
    assert set(told["ci95"]) == set(again.ci95)
    assert told["held_out_rms_m"]["none"] > told["held_out_rms_m"][" + ".join(fit.terms)]


def test_samples_lie_on_the_board_alone():
    rng = np.random.default_rng(0)
    boards = poses(rng, 6)
    views = [view_of(T, 0.0, rng, str(index)) for index, T in enumerate(boards)]
    depths = [depth_of(T, NONE, replace(NOISE, s0_m=1e-6, s1_m=0.0), rng) for T in boards]
    found = board_depth_samples(calibrate(views, SIZE), depths, BOARD)
    assert found.names == tuple(map(str, range(6)))
    np.testing.assert_allclose(found.measured_m, found.true_m, atol=2e-4)
    # A quarter of the pitch is the radius, so that circles cover pi / 16 of the board, and a little more.
    assert 0.18 < found.ink.mean() < 0.35


@pytest.fixture(scope="module")
def near_boards():
    """Poses, and what lens and sensor make of them; boards of the same size need no others."""
    rng = np.random.default_rng(0)
    boards = poses(rng, 4, (0.4, 0.7))
    lens = calibrate([view_of(T, 0.0, rng, str(index)) for index, T in enumerate(boards)], SIZE)
    return boards, lens, [depth_of(T, NONE, NOISE, rng) for T in boards]


@pytest.mark.parametrize(
    ("board", "white"),
    [
        (BOARD, 1.0 - np.pi / 16.0),
        (Board("chessboard", 11, 9, 0.035), 0.5),
        (Board("charuco", 11, 9, 0.035, "4X4_100"), 0.5 * (1.0 - 0.75**2)),
        (Board("aprilgrid", 8, 6, 0.035), 1.0 - (48 + 35 * 0.3**2) / ((8 + 7 * 0.3) * (6 + 5 * 0.3))),
    ],
    ids=lambda value: getattr(value, "pattern", ""),
)
def test_what_counts_as_paper_is_white_on_the_printed_sheet(board, white, near_boards, monkeypatch):
    """White besides whole markers is a known share of the board."""
    boards, lens, depths = near_boards
    paper = (found := board_depth_samples(lens, depths, board)).select(~found.ink)
    rays = RAYS[paper.pixels[:, 1], paper.pixels[:, 0]]
    for view, T in enumerate(boards):
        points_m = (rays * paper.true_m[:, None])[paper.view == view]
        u, v = np.rint(sheet_px(board, apply(inverse(T), points_m)[:, :2])).astype(int).T
        assert len(u) > 20
        assert printed(board)[v, u].min() > 128
    monkeypatch.setattr(depth_samples, "INK_PX", 0.0)
    assert 1.0 - board_depth_samples(lens, depths, board).ink.mean() == pytest.approx(white, abs=0.03)


@pytest.mark.parametrize("rows", [8, 9])
def test_white_of_a_charuco_board_is_white_in_the_layout_of_old_programs(rows, near_boards):
    """With an even number of rows of corners, both layouts are the same."""
    boards, lens, depths = near_boards
    board = Board("charuco", 11, rows, 0.035, "4X4_100")
    paper = (found := board_depth_samples(lens, depths, board, [view.name for view in lens.views])).select(
        ~found.ink
    )
    rays = RAYS[paper.pixels[:, 1], paper.pixels[:, 0]]
    sheet = board.charuco(legacy=True).generateImage((12 * 40, (rows + 1) * 40), marginSize=0)
    for view, T in enumerate(boards):
        points_m = apply(inverse(T), (rays * paper.true_m[:, None])[paper.view == view])[:, :2]
        u, v = np.floor(40.0 * ((points_m - board.points_m[0, :2]) / board.spacing_m + 1.0)).astype(int).T
        assert len(u) > 20
        assert sheet[v, u].min() > 128


def test_the_layout_in_the_photographs_is_that_of_the_ink(near_boards, tmp_path, monkeypatch):
    _, lens, depths = near_boards
    board = Board("charuco", 11, 9, 0.035, "4X4_100")
    found = {view.name: replace(whole(board, view.points_px, True), legacy=True) for view in lens.views}
    files = {name: tmp_path / f"{name}.png" for name in found}
    for path, depth in zip(files.values(), depths, strict=True):
        write_depth_mm(path, depth)
    monkeypatch.setattr(depth_from_images, "fit_depth", lambda found: found)
    told = with_depth(CameraReport(board, found, (), lens, ()), files).depth
    np.testing.assert_array_equal(told.ink, board_depth_samples(lens, depths, board, list(found)).ink)


def test_bad_input_is_refused_in_a_sentence():
    rng = np.random.default_rng(0)
    boards = poses(rng, 6)
    found = calibrate([view_of(T, 0.1, rng, f"view {i}") for i, T in enumerate(boards)], SIZE)
    depths = [depth_of(T, NONE, NOISE, rng) for T in boards]
    with pytest.raises(InputError, match="No depth image has depth where the board is"):
        board_depth_samples(found, [None] * 6, BOARD)
    with pytest.raises(InputError, match="registered"):
        board_depth_samples(found, [DepthMap(np.ones((240, 320), np.float32)), *depths[1:]], BOARD)
    with pytest.raises(InputError, match="unit of the depth images"):
        board_depth_samples(found, [DepthMap(1000.0 * depth.z_m) for depth in depths], BOARD)
    with pytest.raises(InputError, match="3 views have depth on the board's white paper, and it takes 4"):
        fit_depth(board_depth_samples(found, [*depths[:3], None, None, None], BOARD))
    assert CAMERA.width_px == SIZE[0]


def test_samples_begin_three_pixels_inside_the_outermost_points_on_every_side():
    focal_px, away_m = 100.0, 1.0  # 3.5 pixels from circle to circle: 35 x 28 from rim to rim
    lens = Optics("thesis", np.array([[focal_px, 0, 30], [0, focal_px, 30], [0, 0, 1.0]]), np.zeros(5))
    T = np.eye(4)
    T[2, 3] = away_m
    rim_px = lens.project(BOARD.points_m, T)
    pixels = depth_samples._pixels_on_board(BOARD, T, lens, DepthMap(np.full((60, 90), away_m, np.float32)))
    low, high = np.rint(rim_px.min(axis=0)), np.rint(rim_px.max(axis=0))
    assert pixels.min(axis=0).tolist() == (low + depth_samples.RIM_PX).tolist()
    assert pixels.max(axis=0).tolist() == (high - depth_samples.RIM_PX).tolist()

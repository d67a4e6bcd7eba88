"""Points to pixels and back with every lens, and how both change with its numbers."""

import numpy as np
import pytest

from packetmesh.errors import ReconstructionError
from pipeline.calibration import fisheye
from pipeline.calibration.board import Board
from pipeline.calibration.estimate import View, calibrate, held_out, place, rms_px
from pipeline.calibration.lens import FREE, Optics
from pipeline.kernels.geometry import rigid, rotation_exp

MATRIX = np.array([[420.0, 0.0, 318.0], [0.0, 424.0, 243.0], [0.0, 0.0, 1.0]])
LENSES = {
    "thesis": [-0.12, 0.05, 0.0, 0.0, 0.0],
    "brown": [-0.2, 0.1, 1e-3, -2e-3, 0.01],
    "rational": [0.4, 0.1, 1e-3, 0.0, 0.0, 0.5, 0.05, 0.01],
    "fisheye": [-0.02, 0.01, -0.004, 0.001],
}
FISHEYE = np.array(LENSES["fisheye"])
BOARD = Board("circles", 7, 5, 0.035)
POSE = rigid(rotation_exp(np.array([0.3, -0.2, 0.1])), np.array([0.02, -0.01, 0.4]))


def optics(lens):
    return Optics(lens, MATRIX, np.array(LENSES[lens]))


@pytest.mark.parametrize("lens", LENSES)
def test_a_ray_comes_back_to_its_pixel(lens):
    pixels = np.stack(np.meshgrid(np.linspace(0, 639, 9), np.linspace(0, 479, 7)), axis=-1).reshape(-1, 2)
    rays = optics(lens).rays(pixels)
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1.0)
    np.testing.assert_allclose(optics(lens).project(2.0 * rays), pixels, atol=1e-6)


def test_where_a_lens_folds_back_there_is_no_ray():
    folded = Optics("thesis", MATRIX, np.array([-0.9, 0.0, 0.0, 0.0, 0.0]))
    rays = folded.rays(np.array([[318.0, 243.0], [639.0, 479.0]]))
    np.testing.assert_allclose(rays[0], (0.0, 0.0, 1.0), atol=1e-12)
    assert np.isnan(rays[1]).all()


def test_beyond_a_fold_there_is_no_ray_though_the_image_grows_again():
    """r (1 - r^2 + 0.3 r^4) turns at 0.65 and at 1.26, and 1.8 is seen at 1.64."""
    twice = Optics("thesis", MATRIX, np.array([-1.0, 0.3, 0.0, 0.0, 0.0]))
    ways = np.array([[0.3, 0.4, 1.0], [1.8, 0.0, 1.0]])
    rays = twice.rays(twice.project(ways))
    np.testing.assert_allclose(rays[0] / rays[0, 2], ways[0], atol=1e-9)
    assert np.isnan(rays[1]).all()


@pytest.mark.parametrize("lens", LENSES)
def test_derivatives_are_differences(lens):
    told, step = optics(lens).linearised(BOARD.points_m, POSE), 1e-6
    for column, name in enumerate(FREE[lens]):
        matrix, distortion = MATRIX.copy(), np.array(LENSES[lens])
        if name in ("fx", "fy", "cx", "cy"):
            matrix[{"fx": (0, 0), "fy": (1, 1), "cx": (0, 2), "cy": (1, 2)}[name]] += step
        else:
            distortion[column - 4] += step
        moved_px = Optics(lens, matrix, distortion).project(BOARD.points_m, POSE) - told.points_px
        np.testing.assert_allclose(told.by_lens[:, column], moved_px.ravel() / step, rtol=1e-3, atol=1e-3)
    lifted = POSE.copy()
    lifted[2, 3] += step
    lifted_px = optics(lens).project(BOARD.points_m, lifted)
    np.testing.assert_allclose(told.by_pose[:, 5], (lifted_px - told.points_px).ravel() / step, atol=1e-2)


def fisheye_views(noise_px, seed, count=10):
    """Boards near a lens that sees 130° across, each in another part of the image."""
    rng, made = np.random.default_rng(seed), []
    places = [(-0.25, -0.15), (0.25, -0.15), (0.0, 0.0), (-0.25, 0.15), (0.25, 0.15)]
    for index in range(count):
        x_m, y_m = places[index % len(places)]
        turn = rng.uniform(-0.5, 0.5, 3)
        T = rigid(rotation_exp(turn), np.array([x_m, y_m, 0.22 + 0.01 * index]))
        points_px = optics("fisheye").project(BOARD.points_m, T)
        made.append(View(str(index), points_px + rng.normal(0.0, noise_px, points_px.shape), BOARD.points_m))
    return made


def test_a_fisheye_is_found_and_is_as_sure_as_it_says():
    truth = dict(zip(FREE["fisheye"], (420.0, 424.0, 318.0, 243.0, *LENSES["fisheye"]), strict=True))
    exact = calibrate(fisheye_views(1e-4, 0), (640, 480), "fisheye")
    assert exact.parameters == pytest.approx(truth, rel=1e-2, abs=1e-2)
    scores = []
    for seed in range(20):
        found = calibrate(fisheye_views(0.2, seed), (640, 480), "fisheye")
        scores += [(found.parameters[name] - truth[name]) / sd for name, sd in found.standard_errors.items()]
    assert 0.75 < np.std(scores) < 1.25


def test_a_fisheye_is_found_from_a_start_whose_first_steps_lead_astray():
    """From a third of the focal length: steps that make it worse are taken back and shortened."""
    truth = fisheye._optics(np.array([300.0, 300.0, 319.5, 239.5, -0.02, 0.005, 0.0, 0.0]))
    rng, board = np.random.default_rng(0), Board("chessboard", 6, 5, 0.05)
    poses = [
        rigid(rotation_exp(rng.uniform(-0.5, 0.5, 3)), [*rng.uniform(-0.2, 0.1, 2), rng.uniform(0.25, 0.5)])
        for _ in range(8)
    ]
    given = [(board.points_m, truth.project(board.points_m, T)) for T in poses]
    start = fisheye._optics(np.array([100.0, 100.0, 300.0, 250.0, 0.0, 0.0, 0.0, 0.0]))
    cost, found, _ = fisheye.adjust(given, start, poses)
    assert cost < 1e-15
    np.testing.assert_allclose(found.matrix, truth.matrix, atol=1e-6)


def test_fisheye_views_that_were_held_out_are_predicted():
    unseen = held_out(fisheye_views(0.2, 1), (640, 480), 2, "fisheye")
    assert rms_px(np.concatenate([view.residuals_px for view in unseen])) < 1.5 * 0.2 * 2**0.5


@pytest.mark.parametrize("lens", LENSES)
def test_a_board_is_placed_with_every_lens(lens):
    view = View("one", optics(lens).project(BOARD.points_m, POSE), BOARD.points_m)
    found = place(view, MATRIX, np.array(LENSES[lens]), lens)
    np.testing.assert_allclose(found.T_camera_board, POSE, atol=1e-6)
    assert found.rms_px < 1e-6


@pytest.mark.parametrize("f_px", [160.0, 220.0, 500.0])
def test_a_fisheye_that_sees_boards_at_80_degrees_is_found_exactly(f_px):
    wide = Optics("fisheye", np.array([[f_px, 0.0, 318.0], [0.0, f_px, 243.0], [0.0, 0.0, 1.0]]), FISHEYE)
    rng, given = np.random.default_rng(0), []
    while len(given) < 10:
        ray = wide.rays(rng.uniform((0.0, 0.0), (639.0, 479.0))[None])[0]
        if np.isnan(ray[2]):
            continue
        turn = np.cross((0.0, 0.0, 1.0), ray)
        facing = rotation_exp(turn / np.linalg.norm(turn) * np.arccos(ray[2]))
        T = rigid(facing @ rotation_exp(rng.uniform(-0.5, 0.5, 3)), ray * rng.uniform(0.2, 0.4))
        in_camera = BOARD.points_m @ T[:3, :3].T + T[:3, 3]
        if np.degrees(np.arccos(in_camera[:, 2] / np.linalg.norm(in_camera, axis=1))).max() < 80.0:
            given.append(View("", wide.project(BOARD.points_m, T), BOARD.points_m))
    found = calibrate(given, (640, 480), "fisheye")
    np.testing.assert_allclose(found.matrix, wide.matrix, atol=1e-4)
    np.testing.assert_allclose(found.distortion, wide.distortion, atol=1e-4)


def test_views_that_no_lens_explains_give_no_camera():
    rng = np.random.default_rng(0)
    given = [View("", rng.uniform(0.0, 480.0, (35, 2)), BOARD.points_m) for _ in range(5)]
    for lens in ("thesis", "fisheye"):
        with pytest.raises(
            ReconstructionError, match=r"No lens of this kind|nearly the same|cannot be right"
        ):
            calibrate(given, (640, 480), lens)

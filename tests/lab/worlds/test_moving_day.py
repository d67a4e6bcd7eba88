"""The demo whose nodes need calibration: its boards are found among the cartons, and tell the truth."""

from dataclasses import replace

import numpy as np
import pytest

from lab.worlds.board_files import load_board_views
from lab.worlds.board_poses import sees
from lab.worlds.demos import UNCALIBRATED
from packetmesh.progress import drain
from pipeline.acquisition import back_project
from pipeline.calibration.detect import detect
from pipeline.calibration.from_images import image_files, iterate_calibration
from pipeline.io.demos import board_views_of, load_demo
from pipeline.kernels.geometry import apply, project
from pipeline.kernels.rays import tensor, triangle_scene
from pipeline.types import DepthMap

FOLDER = board_views_of(UNCALIBRATED)


@pytest.fixture(scope="module")
def views():
    return load_board_views(FOLDER)


def test_every_board_that_is_whole_is_found_and_nothing_else_is_taken_for_a_circle(views):
    whole = 0
    for moment, images in enumerate(views.images):
        for node, image in enumerate(images):
            camera = views.cameras[node]
            found = detect(image.rgb, views.board)
            if sees(views.board, camera, views.T_world_board[moment]):
                assert found.found, (moment, node, found.reason)
                whole += 1
            if found.found:
                true_px = project(
                    camera.intrinsics, apply(views.T_camera_board(moment, node), views.board.points_m)
                )
                assert found.oriented
                assert np.linalg.norm(found.points_px - true_px, axis=1).max() < 0.5
    assert whole >= 30


@pytest.mark.parametrize("node", range(3))
def test_each_lens_is_found_within_its_standard_errors(views, node):
    files = image_files([str(FOLDER / f"node_{node:02d}" / "color_*.jpg")])
    found = drain(iterate_calibration(files, views.board)).calibration
    true = views.cameras[node].intrinsics
    k1, k2 = true.distortion[:2]
    values = {"fx": true.fx_px, "fy": true.fy_px, "cx": true.cx_px, "cy": true.cy_px, "k1": k1, "k2": k2}
    for name, value in values.items():
        assert abs(found.parameters[name] - value) < 4.0 * found.standard_errors[name], name
    assert found.parameters["fx"] == pytest.approx(true.fx_px, rel=1e-3)


def test_calibration_is_what_the_demo_lacks(views):
    """Even at the true poses points lie centimetres beside the surface, and with the truth they do not."""
    rig = load_demo(UNCALIBRATED)
    surface = triangle_scene(rig.truth.vertices_m, rig.truth.triangles)
    for frame, node in zip(rig.frames, views.cameras, strict=True):
        bias, z_m = node.bias, frame.depth.z_m
        right_m = bias.a_m + (bias.b + bias.share(z_m.shape)) * z_m + bias.c_per_m * z_m**2
        known = replace(frame, intrinsics=node.intrinsics, depth=DepthMap(right_m.astype(np.float32)))
        off_m = []
        for one in (frame, known):
            places_m = apply(node.T_world_camera, back_project(one).points_m[::20])
            off_m.append(float(np.median(surface.compute_distance(tensor(places_m, np.float32)).numpy())))
        assert off_m[0] > 0.015
        assert off_m[1] < 0.007

"""The camera of images in a bag: P of rectified ones, and the binning, region and size of the images."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.io.extrinsics import read_extrinsics
from pipeline.io.intrinsics import read_intrinsics
from pipeline.io.rigs import load_rig
from pipeline.kernels.geometry import pixel_rays, undistorted_rays
from tests.pipeline.importing.bag_parts import (
    RATIONAL,
    D,
    Images,
    Info,
    K,
    P,
    colors,
    rectified,
    wall,
    write_parts,
)

RECT, DEPTH_RECT = "/camera/rgb/image_rect_color", "/camera/depth_registered/image_rect"
RAW, DEPTH_RAW = "/camera/rgb/image_raw", "/camera/depth_registered/image_raw"
INFO, DEPTH_INFO = "/camera/rgb/camera_info", "/camera/depth_registered/camera_info"


def imported(tmp_path, images, infos, kind="ros1"):
    path = write_parts(tmp_path / ("a.bag" if kind == "ros1" else "a"), images, infos, kind)
    report = drain(iterate_import(path, tmp_path / "rig"))
    return report, load_rig(tmp_path / "rig").frames


def values(camera):
    return camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px


@pytest.mark.parametrize("kind", ["ros1", "ros2"])
@pytest.mark.parametrize("info", [Info(d=D), Info(d=RATIONAL, model="rational_polynomial")])
@pytest.mark.parametrize(
    "color",
    [
        RECT,
        "/camera/rgb/image_rect",
        "/camera/rgb/image_color_rect",
        "/camera/rgb/rect/image",
        f"{RECT}/compressed",
    ],
)
def test_rectified_images_have_the_camera_p_and_no_distortion(tmp_path, kind, info, color):
    name = color.removesuffix("/compressed").rsplit("/", 1)[0] + "/camera_info"
    images = {color: Images(colors()), DEPTH_RECT: Images(wall())}
    _, (frame,) = imported(tmp_path, images, {name: info, DEPTH_INFO: info}, kind)
    assert values(frame.intrinsics) == (131.25, 131.25, 79.5, 59.5)
    np.testing.assert_array_equal(frame.intrinsics.distortion, np.zeros(5))


def test_points_of_a_rectified_image_are_those_of_opencv(tmp_path):
    """A pixel of the raw image, its place in the rectified one, and its ray by K and D."""
    info = Info(d=D)
    raw = np.zeros((120, 160, 3), np.uint8)
    cv2.circle(raw, (130, 30), 4, (255, 255, 255), -1)
    images = {RECT: Images(rectified(raw, info)[None]), DEPTH_RECT: Images(wall())}
    _, (frame,) = imported(tmp_path, images, {INFO: info, DEPTH_INFO: info})
    spot = np.argwhere(frame.rgb[..., 0] > 128).mean(axis=0)[::-1]
    ray = undistorted_rays(frame.intrinsics, spot[None])[0]
    expected = cv2.undistortPoints(np.array([[[130.0, 30.0]]]), K, D)[0, 0]
    np.testing.assert_allclose(ray[:2], expected, atol=3e-3)
    assert (
        np.abs(undistorted_rays(replace(frame.intrinsics, matrix=K), spot[None])[0, :2] - expected).max()
        > 0.01
    )


@pytest.mark.parametrize("color", [RAW, "/camera/rgb/image_unrect", "/camera/rgb/direct"])
def test_other_images_have_the_camera_k_and_d(tmp_path, color):
    images = {color: Images(colors()), DEPTH_RAW: Images(wall())}
    _, (frame,) = imported(tmp_path, images, {INFO: Info(d=D)})
    assert values(frame.intrinsics) == (139.125, 139.125, 81.0, 58.5)
    np.testing.assert_array_equal(frame.intrinsics.distortion, D)


def test_rectified_images_without_p_open_when_the_raw_ones_are_recorded(tmp_path):
    info = Info(d=D, p=np.zeros((3, 4)))
    with pytest.raises(InputError, match=r"no projection matrix P.*record the images before rectification"):
        imported(tmp_path, {RECT: Images(colors()), DEPTH_RECT: Images(wall())}, {INFO: info})
    _, frames = imported(tmp_path / "raw", {RAW: Images(colors()), DEPTH_RAW: Images(wall())}, {INFO: info})
    assert len(frames) == 1


@pytest.mark.parametrize(
    ("changes", "size", "expected"),
    [
        ({"binning": (2, 2)}, (80, 60), (65.625, 65.625, 39.5, 29.5)),
        ({"binning": (4, 2)}, (40, 60), (32.8125, 65.625, 19.5, 29.5)),
        ({"region": (40, 20, 100, 80)}, (100, 80), (131.25, 131.25, 39.5, 39.5)),
        ({"region": (40, 20, 100, 80), "binning": (2, 2)}, (50, 40), (65.625, 65.625, 19.5, 19.5)),
        ({"binning": (2, 2)}, (160, 120), (131.25, 131.25, 79.5, 59.5)),
        ({"region": (0, 0, 160, 120)}, (160, 120), (131.25, 131.25, 79.5, 59.5)),
        ({"size": (0, 0)}, (160, 120), (131.25, 131.25, 79.5, 59.5)),
        (
            {"size": (640, 480), "k": P[:, :3] * [[4.0], [4.0], [1.0]]},
            (160, 120),
            (131.25, 131.25, 79.125, 59.125),
        ),
    ],
)
def test_the_camera_is_that_of_the_images_by_binning_region_and_size(tmp_path, changes, size, expected):
    """A pixel of two columns and rows has its centre between theirs: 79.5 becomes (79.5 + 0.5) / 2 - 0.5."""
    info = replace(Info(k=P[:, :3]), **changes)
    images = {RAW: Images(colors(size=size)), DEPTH_RAW: Images(wall(size=size))}
    report, (frame,) = imported(tmp_path, images, {INFO: info})
    assert values(frame.intrinsics) == pytest.approx(expected, abs=1e-12)
    assert any("taken as the whole view, resized" in note for note in report.notes) is (
        info.size == (640, 480)
    )


def test_a_camera_of_another_shape_is_refused_with_all_sizes(tmp_path):
    images = {RAW: Images(colors(size=(100, 90))), DEPTH_RAW: Images(wall(size=(100, 90)))}
    with pytest.raises(
        InputError, match=r"camera_info is for 160 x 120 pixels, .* the images have 100 x 90; try"
    ):
        imported(tmp_path, images, {INFO: Info()})


def test_depth_with_a_camera_of_its_own_in_the_frame_of_colour_is_registered_from_there(tmp_path):
    """Its focal length is half as long: what is at its column 79.5 + 30 is at column 79.5 + 60 of colour."""
    half = np.array([[65.625, 0.0, 79.5], [0.0, 65.625, 59.5], [0.0, 0.0, 1.0]])
    depth = wall()
    depth[0, :, 110:] = 3000
    images = {RAW: Images(colors()), DEPTH_RAW: Images(depth)}
    report, (frame,) = imported(tmp_path, images, {INFO: Info(k=P[:, :3]), DEPTH_INFO: Info(k=half)})
    node = tmp_path / "rig" / "node_00"
    assert values(read_intrinsics(node / "depth_intrinsics.json")) == (65.625, 65.625, 79.5, 59.5)
    np.testing.assert_array_equal(read_extrinsics(node / "extrinsics.json"), np.eye(4))
    edge = np.flatnonzero(frame.depth.z_m[60] > 2.5)[0]
    assert edge == pytest.approx(79.5 + 2 * (109.5 - 79.5), abs=1.0)
    assert any("its camera_info is not that of" in note for note in report.notes)


def test_depth_of_the_same_view_in_fewer_pixels_has_the_colour_camera_resized(tmp_path):
    images = {RAW: Images(colors()), DEPTH_RAW: Images(wall(size=(80, 60)))}
    _, (frame,) = imported(tmp_path, images, {INFO: Info(k=P[:, :3])})
    camera = read_intrinsics(tmp_path / "rig" / "node_00" / "depth_intrinsics.json")
    assert values(camera) == (65.625, 65.625, 39.5, 29.5)
    np.testing.assert_allclose(frame.depth.z_m, 2.0, atol=1e-6)


def test_depth_of_another_shape_opens_when_its_camera_info_is_recorded(tmp_path):
    """The remedy of the message."""
    images = {RAW: Images(colors()), DEPTH_RAW: Images(wall(size=(90, 60)))}
    with pytest.raises(InputError, match=f"try to record the camera_info of {DEPTH_RAW}, too"):
        imported(tmp_path, images, {INFO: Info(k=P[:, :3])})
    own = Info(k=np.array([[65.0, 0.0, 44.5], [0.0, 65.0, 29.5], [0.0, 0.0, 1.0]]), size=(90, 60))
    infos = {INFO: Info(k=P[:, :3]), DEPTH_INFO: own}
    _, (frame,) = imported(tmp_path / "again", images, infos)
    np.testing.assert_allclose(frame.depth.z_m[frame.depth.valid], 2.0, atol=1e-6)


def test_a_camera_info_of_another_name_is_found_by_the_frame_and_said(tmp_path):
    images = {RAW: Images(colors()), DEPTH_RAW: Images(wall())}
    infos = {"/camera/rgb/info": Info(k=P[:, :3]), "/other/camera_info": Info(frame="elsewhere")}
    report, (frame,) = imported(tmp_path, images, infos)
    assert frame.intrinsics.fx_px == 131.25
    assert f"/camera/rgb/info is taken as the camera of {RAW}: it has the same frame, optical" in report.notes


def test_two_camera_infos_that_fit_are_named_and_recording_the_usual_one_helps(tmp_path):
    images = {RAW: Images(colors()), DEPTH_RAW: Images(wall())}
    infos = {"/camera/rgb/info_a": Info(), "/camera/rgb/info_b": Info(k=P[:, :3])}
    says = f"which has only /camera/rgb/info_a, /camera/rgb/info_b; try to record {INFO}, too"
    with pytest.raises(InputError, match=says):
        imported(tmp_path, images, infos)
    _, (frame,) = imported(tmp_path / "again", images, {**infos, INFO: Info(k=P[:, :3])})
    assert frame.intrinsics.fx_px == 131.25


def test_a_camera_that_is_not_calibrated_is_left_out_and_not_the_whole_bag(tmp_path):
    """An infrared image with an empty camera_info next to colour."""
    images = {
        RAW: Images(colors()),
        DEPTH_RAW: Images(wall()),
        "/camera/ir/image": Images(colors(), frame="ir"),
    }
    infos = {INFO: Info(k=P[:, :3]), "/camera/ir/camera_info": Info(k=np.zeros((3, 3)), frame="ir")}
    report, frames = imported(tmp_path, images, infos)
    assert len(frames) == 1
    assert any(
        "/camera/ir/image is left out" in note and "is not calibrated" in note for note in report.notes
    )


def test_rays_of_a_binned_camera_are_the_means_of_its_pixels():
    """Of the camera itself, without a bag."""
    from pipeline.importing.bag_cameras import _binned
    from pipeline.types import CameraIntrinsics

    camera = CameraIntrinsics.pinhole(131.25, 131.25, 79.5, 59.5, 160, 120)
    means = cv2.resize(pixel_rays(camera)[..., :2], (80, 60), interpolation=cv2.INTER_AREA)
    np.testing.assert_allclose(pixel_rays(_binned(camera, (2, 2)))[..., :2], means, atol=1e-12)


@pytest.mark.parametrize("missing", ["colour", "depth"])
def test_a_bag_that_lacks_images_names_what_it_has_and_opens_when_both_are_recorded(tmp_path, missing):
    images = {RAW: Images(colors()), DEPTH_RAW: Images(wall())}
    some = {RAW: images[RAW]} if missing == "depth" else {DEPTH_RAW: images[DEPTH_RAW]}
    (here,) = some
    with pytest.raises(InputError, match=f"has no {missing} images but {here}; try to record both"):
        imported(tmp_path, some, {INFO: Info()})
    assert len(imported(tmp_path / "again", images, {INFO: Info()})[1]) == 1


def test_a_bag_without_images_names_its_topics(tmp_path):
    with pytest.raises(InputError, match=r"no images at all but /camera/rgb/camera_info \(sensor_msgs"):
        imported(tmp_path, {RAW: Images(colors(0))}, {INFO: Info()})


def test_intrinsics_next_to_a_bag_are_not_used_and_the_bag_opens_without(tmp_path):
    path = write_parts(tmp_path / "a.bag", {RAW: Images(colors()), DEPTH_RAW: Images(wall())}, {INFO: Info()})
    with pytest.raises(InputError, match="are read from its camera_info; try without intrinsics"):
        drain(iterate_import(path, tmp_path / "rig", intrinsics=tmp_path / "camera.json"))
    assert len(drain(iterate_import(path, tmp_path / "rig")).frames) == 1
